/* Prints the grids of a file and hashes of all their values, to compare two builds of the library. */

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "esvr/esvr.h"

static void check(esvr_status status) {
  if (status == ESVR_OK) return;
  fprintf(stderr, "%s\n", esvr_error());
  exit((int)status);
}

/* FNV-1a. */
static uint64_t hashed(uint64_t hash, const void* bytes, size_t size) {
  const unsigned char* at = bytes;
  for (size_t i = 0; i < size; ++i) hash = (hash ^ at[i]) * UINT64_C(1099511628211);
  return hash;
}
static const uint64_t kStart = UINT64_C(14695981039346656037);

static void print_voxels(const esvr_file* file, size_t grid) {
  esvr_volume* volume = NULL;
  uint64_t hash = kStart;
  check(esvr_decode(file, grid, NULL, 0, &volume));
  for (size_t b = 0; b < esvr_brick_count(volume); ++b) {
    esvr_brick brick;
    check(esvr_get_brick(volume, b, &brick));
    hash = hashed(hash, brick.corner, sizeof brick.corner);
    hash = hashed(hash, brick.values, ESVR_BRICK_VOXELS * sizeof(float));
    hash = hashed(hash, brick.active, ESVR_BRICK_SIDE * sizeof(uint64_t));
  }
  printf("  %zu bricks, %016llx\n", esvr_brick_count(volume), (unsigned long long)hash);
  esvr_free_volume(volume);
}

static void print_ellipsoids(const esvr_file* file, size_t grid, uint64_t count) {
  esvr_ellipsoid* all = malloc((size_t)count * sizeof *all);
  uint64_t hash = kStart;
  check(esvr_get_ellipsoids(file, grid, 0, count, all));
  for (uint64_t i = 0; i < count; ++i) {
    hash = hashed(hash, all[i].center, sizeof all[i].center);
    hash = hashed(hash, all[i].scale, sizeof all[i].scale + sizeof all[i].rotation);
  }
  printf("  %llu ellipsoids, %016llx\n", (unsigned long long)count, (unsigned long long)hash);
  free(all);
}

int main(int argc, char** argv) {
  esvr_file* file = NULL;
  if (argc != 2) return ESVR_USAGE;
  check(esvr_open(argv[1], 0, &file));
  for (size_t g = 0; g < esvr_grid_count(file); ++g) {
    esvr_grid grid = {.size = sizeof grid};
    check(esvr_get_grid(file, g, &grid));
    printf("%s: %llu voxels from %g to %g\n", grid.name, (unsigned long long)grid.active_voxels,
           (double)grid.low, (double)grid.high);
    print_voxels(file, g);
    if (grid.ellipsoids > 0) print_ellipsoids(file, g, grid.ellipsoids);
  }
  esvr_close(file);
  return 0;
}
