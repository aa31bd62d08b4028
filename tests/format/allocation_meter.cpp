#include "format/sample_files.h"

#include <cstdlib>
#include <new>

namespace {

thread_local std::size_t allocated = 0;

}  // namespace

// All forms of new and delete except the aligned ones are replaced. Otherwise a sanitizer's own
// would allocate what these free.
void* operator new(std::size_t n, const std::nothrow_t&) noexcept {
  allocated += n;
  return std::malloc(n == 0 ? 1 : n);
}
void* operator new(std::size_t n) {
  if (void* p = operator new(n, std::nothrow)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, const std::nothrow_t&) noexcept { std::free(p); }

namespace esvr::test {

AllocationMeter::AllocationMeter() : start_(allocated) {}
std::size_t AllocationMeter::bytes() const { return allocated - start_; }

}  // namespace esvr::test
