#pragma once
/// Converts errors of OpenVDB, NanoVDB and the streams to the library's own.

#include <filesystem>
#include <string>
#include <utility>

#include "esvr/grid_names.h"

namespace esvr::vdb {

/// Rethrows the current exception as an esvr::Error whose text begins with `where`. The library's
/// own errors keep their type; exceptions of the VDB libraries become BadInput.
[[noreturn]] void rethrowWhileReading(const std::string& where);
/// The same for writing, where exceptions of the VDB libraries become RuntimeFailure.
[[noreturn]] void rethrowWhileWriting(const std::string& where);

/// Runs `body` and adds `path` to the text of its errors.
template <class Body>
decltype(auto) whileReading(const std::filesystem::path& path, Body&& body) {
  try {
    return std::forward<Body>(body)();
  } catch (...) {
    rethrowWhileReading(path.string() + ": ");
  }
}

/// Runs `body` and adds the name of a grid to the text of its errors. It is used inside
/// whileReading.
/// \param nameOf  gives the name as users see it; it is called if there is an error
template <class NameOf, class Body>
decltype(auto) inNamedGrid(const NameOf& nameOf, Body&& body) {
  try {
    return std::forward<Body>(body)();
  } catch (...) {
    rethrowWhileReading("grid \"" + nameOf() + "\": ");
  }
}

/// The same for a name from a file.
template <class Body>
decltype(auto) inGrid(const std::string& name, Body&& body) {
  return inNamedGrid([&] { return shownName(name); }, std::forward<Body>(body));
}

template <class Body>
decltype(auto) whileWriting(const std::filesystem::path& path, Body&& body) {
  try {
    return std::forward<Body>(body)();
  } catch (...) {
    rethrowWhileWriting(path.string() + ": ");
  }
}

}  // namespace esvr::vdb
