#pragma once
/// The border where errors of OpenVDB, NanoVDB and the streams become the library's own.

#include <filesystem>
#include <string>
#include <utility>

namespace esvr::vdb {

/// Rethrows the exception in flight as an esvr::Error whose text begins with `where`. The library's
/// own errors keep their kind; what the VDB libraries throw while reading is BadInput.
[[noreturn]] void rethrowWhileReading(const std::string& where);
/// The same while writing, where it is RuntimeFailure.
[[noreturn]] void rethrowWhileWriting(const std::string& where);

/// Runs `body`, whose errors are about `path`.
template <class Body>
decltype(auto) whileReading(const std::filesystem::path& path, Body&& body) {
  try {
    return std::forward<Body>(body)();
  } catch (...) {
    rethrowWhileReading(path.string() + ": ");
  }
}

/// Runs `body`, whose errors are about one grid. Nests in whileReading.
template <class Body>
decltype(auto) inGrid(const std::string& name, Body&& body) {
  try {
    return std::forward<Body>(body)();
  } catch (...) {
    rethrowWhileReading("grid \"" + name + "\": ");
  }
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
