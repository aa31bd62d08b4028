#include "cli/failure.h"

#include <exception>
#include <new>

namespace esvr::cli {

Error currentFailure() {
  try {
    throw;
  } catch (const Error& error) {
    return error;
  } catch (const std::bad_alloc&) {
    return {ErrorKind::kDevice, "out of memory"};
  } catch (const std::exception& error) {
    return {ErrorKind::kRuntime, error.what()};
  }
}

}  // namespace esvr::cli
