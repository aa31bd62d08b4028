// Plan: in each function of the C interface that can fail, one allocation after the other fails. The
// function must return ESVR_MEMORY with a text, must not let an exception out, and must work when it
// is called again.

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <new>
#include <string>
#include <vector>

#include "esvr/esvr.h"

namespace {

/// Allocations that still succeed; negative: all do.
long left = -1;

void* allocate(std::size_t bytes) {
  if (left == 0) throw std::bad_alloc();
  if (left > 0) --left;
  if (void* memory = std::malloc(bytes ? bytes : 1)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t bytes) { return allocate(bytes); }
void* operator new[](std::size_t bytes) { return allocate(bytes); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace {

int failures = 0;

void expect(bool good, const char* function, long allocation, const char* what) {
  if (good) return;
  std::printf("%s, allocation %ld: %s\n", function, allocation, what);
  ++failures;
}

/// \return the number of allocations that a call makes
long failInTurn(const char* function, const std::function<esvr_status()>& call) {
  constexpr long kMost = 1'000'000;
  for (long n = 0; n < kMost; ++n) {
    left = n;
    const esvr_status status = call();
    left = -1;
    if (status == ESVR_OK) return n;
    expect(status == ESVR_MEMORY, function, n, "another status than ESVR_MEMORY");
    expect(*esvr_error() != '\0', function, n, "no text");
  }
  expect(false, function, kMost, "it never succeeds");
  return kMost;
}

std::vector<char> contentOf(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "rb");
  std::vector<char> bytes;
  for (int c; file && (c = std::fgetc(file)) != EOF;) bytes.push_back(char(c));
  if (file) std::fclose(file);
  return bytes;
}

}  // namespace

int main(int, char** argv) {
  const std::string path = std::string(argv[1]) + "/residual.esvr",
                    ellipsoids = std::string(argv[1]) + "/quantised.esvr";
  const auto bytes = contentOf(path);
  esvr_file *file = nullptr, *other = nullptr, *sum = nullptr;
  long all = 0;
  all += failInTurn("esvr_open", [&] { return esvr_open(path.c_str(), 0, &file); });
  all += failInTurn("esvr_open_memory",
                    [&] { return esvr_open_memory(bytes.data(), bytes.size(), "m", 0, &other); });
  if (esvr_open(ellipsoids.c_str(), 0, &sum) != ESVR_OK) return 1;
  esvr_grid grid{};
  grid.size = sizeof grid;
  all += failInTurn("esvr_get_grid", [&] { return esvr_get_grid(sum, 0, &grid); });
  std::vector<esvr_ellipsoid> copy(grid.ellipsoids);
  all += failInTurn("esvr_get_ellipsoids",
                    [&] { return esvr_get_ellipsoids(sum, 0, 0, grid.ellipsoids, copy.data()); });
  const double place[3] = {0.0, 0.0, 0.0};
  float value = 0.0f;
  all += failInTurn("esvr_evaluate", [&] { return esvr_evaluate(sum, 0, 1, place, &value); });
  esvr_volume* volume = nullptr;
  all += failInTurn("esvr_decode", [&] { return esvr_decode(sum, 0, nullptr, 0, &volume); });
  const std::int32_t box[6] = {0, 0, 0, 1, 1, 1};
  float values[8];
  all += failInTurn("esvr_decode_box",
                    [&] { return esvr_decode_box(file, 0, box, 0, values, nullptr); });
  esvr_brick brick{};
  if (esvr_brick_count(volume) > 0)
    all += failInTurn("esvr_get_brick", [&] { return esvr_get_brick(volume, 0, &brick); });
  all += failInTurn("esvr_sample", [&] { return esvr_sample(volume, 1, place, &value); });
  expect(all > 50, "all functions", all, "hardly anything was allocated");

  // Errors, whose texts are allocated, too.
  for (long n = 0; n < 20; ++n) {
    left = n;
    const esvr_status status = esvr_get_grid(file, 99, &grid);
    left = -1;
    expect(status == ESVR_USAGE || status == ESVR_MEMORY, "esvr_get_grid(99)", n, "wrong status");
  }
  esvr_free_volume(volume);
  for (esvr_file* f : {file, other, sum}) esvr_close(f);
  return failures ? 1 : 0;
}
