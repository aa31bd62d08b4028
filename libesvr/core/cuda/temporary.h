#pragma once
/// Temporary memory for functions of CUB.

#include "core/cuda/growing_buffer.h"

namespace esvr::cuda {

/// Calls a function of CUB twice: once to get the size of its temporary memory, and once with it.
/// \param call  call(void* temporary, std::size_t& bytes) -> cudaError_t
template <class Call>
void withTemporary(GrowingBuffer<char>& memory, const char* doing, Call&& call) {
  std::size_t bytes = 0;
  check(call(nullptr, bytes), doing);
  check(call(memory.reserve(bytes > 0 ? bytes : 1), bytes), doing);
}

}  // namespace esvr::cuda
