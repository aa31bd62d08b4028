/* The C interface (esvr/esvr.h), used from C on the golden files of the format.
 *
 * Plan: a file opens from its path and from memory; its voxels are the same by brick, by box and by
 * place; the sum of ellipsoids at voxels is the voxels' value up to the rounding of float32 sums;
 * every failure has a status and a text. */

#include "esvr/esvr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char* golden;
static int failures;

static void expect(int good, const char* what, int line) {
  if (good) return;
  fprintf(stderr, "esvr_test.c:%d: expected %s; the last error is '%s'\n", line, what,
          esvr_error());
  ++failures;
}
#define EXPECT(condition) expect((condition) != 0, #condition, __LINE__)

static const char* path_of(const char* name) {
  static char path[4096];
  snprintf(path, sizeof path, "%s/%s.esvr", golden, name);
  return path;
}

static esvr_file* open_golden(const char* name) {
  esvr_file* file = NULL;
  EXPECT(esvr_open(path_of(name), 0, &file) == ESVR_OK);
  EXPECT(file != NULL);
  return file;
}

static esvr_grid describe(const esvr_file* file, size_t number) {
  esvr_grid grid = {.size = sizeof grid};
  EXPECT(esvr_get_grid(file, number, &grid) == ESVR_OK);
  return grid;
}

/* A file in memory. */
typedef struct bytes {
  unsigned char* at;
  size_t size;
} bytes;

static bytes read_golden(const char* name) {
  bytes b = {NULL, 0};
  FILE* in = fopen(path_of(name), "rb");
  EXPECT(in != NULL);
  if (in == NULL) return b;
  fseek(in, 0, SEEK_END);
  b.size = (size_t)ftell(in);
  rewind(in);
  b.at = malloc(b.size);
  EXPECT(fread(b.at, 1, b.size, in) == b.size);
  fclose(in);
  return b;
}

static void values_agree_by_brick_box_and_place(const char* name) {
  esvr_file* file = open_golden(name);
  const esvr_grid grid = describe(file, 0);
  const int32_t* box = grid.box;
  const size_t y = (size_t)(box[4] - box[1] + 1), z = (size_t)(box[5] - box[2] + 1),
               count = (size_t)(box[3] - box[0] + 1) * y * z;
  float* values = malloc(count * sizeof *values);
  uint8_t* active = malloc(count);
  esvr_volume* volume = NULL;
  EXPECT(esvr_decode_box(file, 0, box, 0, values, active) == ESVR_OK);
  EXPECT(esvr_decode(file, 0, NULL, 0, &volume) == ESVR_OK);
  EXPECT(esvr_brick_count(volume) > 0);
  double* places = malloc(count * 3 * sizeof *places);
  float* sampled = malloc(count * sizeof *sampled);
  for (size_t i = 0; i < count; ++i) {
    places[3 * i] = box[0] + (double)(i / (y * z));
    places[3 * i + 1] = box[1] + (double)(i / z % y);
    places[3 * i + 2] = box[2] + (double)(i % z);
  }
  EXPECT(esvr_sample(volume, count, places, sampled) == ESVR_OK);
  uint64_t actives = 0, same = 0;
  for (size_t i = 0; i < count; ++i) same += sampled[i] == values[i], actives += active[i];
  EXPECT(same == count);
  uint64_t in_bricks = 0;
  for (size_t b = 0; b < esvr_brick_count(volume); ++b) {
    esvr_brick brick;
    EXPECT(esvr_get_brick(volume, b, &brick) == ESVR_OK);
    EXPECT(brick.corner[0] % ESVR_BRICK_SIDE == 0);
    for (int v = 0; v < ESVR_BRICK_VOXELS; ++v) in_bricks += brick.active[v / 64] >> (v % 64) & 1;
  }
  EXPECT(actives == in_bricks);
  EXPECT(actives > 0);
  free(places);
  free(sampled);
  free(values);
  free(active);
  esvr_free_volume(volume);
  esvr_close(file);
}

static void sums_at_voxels_are_their_values(const char* name) {
  esvr_file* file = open_golden(name);
  const esvr_grid grid = describe(file, 0);
  EXPECT(grid.ellipsoids > 0);
  esvr_ellipsoid* all = malloc((size_t)grid.ellipsoids * sizeof *all);
  EXPECT(esvr_get_ellipsoids(file, 0, 0, grid.ellipsoids, all) == ESVR_OK);
  double sum = 0.0;
  for (uint64_t i = 0; i < grid.ellipsoids; ++i) sum += fabs((double)all[i].intensity);
  const double tolerance = 8e-6 * sum; /* twice that of evaluateBricks (field.h) */
  esvr_volume* volume = NULL;
  EXPECT(esvr_decode(file, 0, NULL, 0, &volume) == ESVR_OK);
  for (size_t b = 0; b < esvr_brick_count(volume); ++b) {
    esvr_brick brick;
    EXPECT(esvr_get_brick(volume, b, &brick) == ESVR_OK);
    double places[3 * ESVR_BRICK_VOXELS];
    float values[ESVR_BRICK_VOXELS];
    for (int v = 0; v < ESVR_BRICK_VOXELS; ++v) {
      places[3 * v] = brick.corner[0] + v / 64;
      places[3 * v + 1] = brick.corner[1] + v / 8 % 8;
      places[3 * v + 2] = brick.corner[2] + v % 8;
    }
    EXPECT(esvr_evaluate(file, 0, ESVR_BRICK_VOXELS, places, values) == ESVR_OK);
    for (int v = 0; v < ESVR_BRICK_VOXELS; ++v)
      if (brick.active[v / 64] >> (v % 64) & 1) {
        /* The source was saved as half, to which decoded voxels are rounded and sums are not. */
        const double half = fabs((double)values[v]) * 0x1p-11 + 0x1p-25;
        EXPECT(fabs((double)values[v] - (double)brick.values[v]) <= tolerance + half);
      }
  }
  free(all);
  esvr_free_volume(volume);
  esvr_close(file);
}

static void bytes_in_memory_are_a_file_too(void) {
  bytes b = read_golden("voxels");
  esvr_file* file = NULL;
  EXPECT(esvr_open_memory(b.at, b.size, "memory", 0, &file) == ESVR_OK);
  EXPECT(esvr_grid_count(file) == 1);
  esvr_close(file);
  free(b.at);
}

/* Every byte is covered by a checksum or must be zero, so that no damage passes. */
static void damage_anywhere_is_found(const char* name) {
  bytes b = read_golden(name);
  for (size_t i = 0; i < b.size; ++i) {
    esvr_file* file = NULL;
    b.at[i] ^= 0x10;
    EXPECT(esvr_open_memory(b.at, b.size, "damaged", 0, &file) == ESVR_BAD_INPUT);
    EXPECT(file == NULL);
    EXPECT(strstr(esvr_error(), "damaged") != NULL);
    b.at[i] ^= 0x10;
  }
  esvr_file* file = NULL;
  for (size_t size = 0; size < b.size; ++size)
    EXPECT(esvr_open_memory(b.at, size, "cut", 0, &file) == ESVR_BAD_INPUT);
  free(b.at);
}

static void failures_have_a_status_and_a_text(void) {
  esvr_file* file = NULL;
  float value = 0.0f;
  const double place[3] = {0.0, 0.0, 0.0};
  EXPECT(esvr_open("/there/is/no.esvr", 0, &file) == ESVR_BAD_INPUT);
  EXPECT(file == NULL && strstr(esvr_error(), "/there/is/no.esvr") != NULL);
  EXPECT(esvr_open(NULL, 0, &file) == ESVR_USAGE);
  EXPECT(esvr_open(path_of("voxels"), 16, &file) == ESVR_MEMORY);
  EXPECT(esvr_grid_count(NULL) == 0);
  EXPECT(esvr_evaluate(NULL, 0, 1, place, &value) == ESVR_USAGE);
  file = open_golden("voxels");
  esvr_grid grid = {.size = sizeof grid};
  EXPECT(esvr_get_grid(file, 1, &grid) == ESVR_USAGE && strstr(esvr_error(), "no grid 1") != NULL);
  EXPECT(esvr_evaluate(file, 0, 1, place, &value) == ESVR_USAGE);
  const int32_t empty[6] = {1, 0, 0, 0, 0, 0};
  EXPECT(esvr_decode_box(file, 0, empty, 0, &value, NULL) == ESVR_USAGE);
  esvr_volume* volume = NULL;
  esvr_close(file);
  file = open_golden("compressed");
  EXPECT(esvr_decode(file, 0, NULL, 1, &volume) == ESVR_MEMORY && volume == NULL);
  const double nowhere[3] = {NAN, 0.0, 0.0};
  EXPECT(esvr_evaluate(file, 0, 1, nowhere, &value) == ESVR_USAGE);
  esvr_close(file);
  esvr_close(NULL);
  esvr_free_volume(NULL);
}

/* An older program knows fewer members of a struct; those that follow stay untouched. */
static void a_smaller_struct_gets_the_members_that_it_has(void) {
  esvr_file* file = open_golden("voxels");
  esvr_grid grid;
  memset(&grid, 0x55, sizeof grid);
  grid.size = offsetof(esvr_grid, background);
  EXPECT(esvr_get_grid(file, 0, &grid) == ESVR_OK);
  const unsigned char* rest = (const unsigned char*)&grid + offsetof(esvr_grid, background);
  EXPECT(grid.name != NULL && rest[0] == 0x55 && rest[3] == 0x55);
  esvr_close(file);
}

static void carried_grids_are_named(void) {
  esvr_file* file = open_golden("carried");
  EXPECT(esvr_carried_count(file) > 0);
  EXPECT(strlen(esvr_carried_name(file, 0)) > 0);
  EXPECT(strcmp(esvr_carried_name(file, 1000), "") == 0);
  esvr_close(file);
}

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  golden = argv[1];
  const char* every[] = {"compressed",     "copied_voxels", "mirrored_voxels",
                         "related_voxels", "two_grids",     "voxels"};
  for (size_t i = 0; i < sizeof every / sizeof *every; ++i)
    values_agree_by_brick_box_and_place(every[i]);
  sums_at_voxels_are_their_values("compressed");
  sums_at_voxels_are_their_values("two_grids");
  bytes_in_memory_are_a_file_too();
  damage_anywhere_is_found("compressed");
  failures_have_a_status_and_a_text();
  a_smaller_struct_gets_the_members_that_it_has();
  carried_grids_are_named();
  if (failures > 0) fprintf(stderr, "%d expectations failed\n", failures);
  return failures > 0;
}
