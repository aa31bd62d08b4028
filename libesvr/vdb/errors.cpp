#include "vdb/errors.h"

#include <ios>
#include <new>
#include <stdexcept>

#include "esvr/error.h"

namespace esvr::vdb {
namespace {

/// Rethrows errors that mean the same in reading and writing.
void rethrowCommon(const std::string& where) {
  try {
    throw;
  } catch (const Cancelled&) {
    throw;
  } catch (const NotFinite& e) {
    throw NotFinite(where + e.what());
  } catch (const CannotConvert& e) {
    throw CannotConvert(where + e.what());
  } catch (const BadInput& e) {
    throw BadInput(where + e.what());
  } catch (const UsageError& e) {
    throw UsageError(where + e.what());
  } catch (const MemoryExceeded& e) {
    throw MemoryExceeded(where + e.what());
  } catch (const RuntimeFailure& e) {
    throw RuntimeFailure(where + e.what());
  } catch (const Error& e) {
    throw Error(e.kind(), where + e.what());
  } catch (const std::bad_alloc&) {
    throw RuntimeFailure(where + "out of memory");
  } catch (const std::logic_error&) {
    throw;  // an error of this library, which must not look like an error of the file
  } catch (...) {
  }
}

}  // namespace

void rethrowWhileReading(const std::string& where) {
  rethrowCommon(where);
  try {
    throw;
  } catch (const std::ios_base::failure&) {
    throw BadInput(where + "is truncated or cannot be read");
  } catch (const std::exception& e) {
    throw BadInput(where + e.what());
  }
}

void rethrowWhileWriting(const std::string& where) {
  rethrowCommon(where);
  try {
    throw;
  } catch (const std::ios_base::failure&) {
    throw RuntimeFailure(where + "cannot be written: the disk is full or failing");
  } catch (const std::exception& e) {
    throw RuntimeFailure(where + e.what());
  }
}

}  // namespace esvr::vdb
