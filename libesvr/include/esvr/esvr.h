#ifndef ESVR_ESVR_H
#define ESVR_ESVR_H
/// The C interface of the decoder: opens .esvr files and gives their ellipsoids and voxels. It is
/// part of the library and of the decoder-only build (ESVR_DECODER_ONLY), which needs nothing but
/// the C++ library.
///
/// Every function that can fail returns a status. esvr_error() then has a text that names the file
/// and the grid. No exception and no C++ type crosses this interface. Several threads may use one
/// esvr_file or esvr_volume at the same time, unless one of them closes it. A null pointer where an
/// object is expected gives ESVR_USAGE; closing a null pointer does nothing.
///
/// Coordinates are those of the grid's index space: voxel (i, j, k) lies at (i, j, k).
///
/// The interface is stable: a later version adds functions, and members at the end of structs whose
/// first member is `size`. The caller sets that member to the size of the struct that it knows; only
/// so many bytes are written.

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum esvr_status {
  ESVR_OK = 0,
  ESVR_FAILED = 1, /* something in the environment failed */
  ESVR_USAGE = 2,  /* an argument is invalid */
  ESVR_BAD_INPUT =
      3,          /* the file is missing, damaged, or of a kind that this decoder does not read */
  ESVR_MEMORY = 5 /* more memory is needed than is allowed or available */
} esvr_status;

typedef struct esvr_file esvr_file;
typedef struct esvr_volume esvr_volume;

enum { ESVR_BRICK_SIDE = 8, ESVR_BRICK_VOXELS = 512 };

/// The version of the library as "0.1.0".
const char* esvr_version(void);

/// The text of the calling thread's last failure; "" if there was none. The next call of the same
/// thread may replace it.
const char* esvr_error(void);

/// Opens a file. All of it is read and checked.
/// \param path        in the encoding of the system's file names
/// \param max_memory  limit on the bytes that its content may take; 0: half of the memory of the
///                    machine; UINT64_MAX: no limit
/// \param file        output; null on failure
esvr_status esvr_open(const char* path, uint64_t max_memory, esvr_file** file);

/// Opens a file whose bytes are in memory. They are not needed any more afterwards.
/// \param name  name of the file in error texts
esvr_status esvr_open_memory(const void* bytes, size_t size, const char* name, uint64_t max_memory,
                             esvr_file** file);
void esvr_close(esvr_file* file);

/// Number of grids that can be decoded. A grid of vectors counts as three.
size_t esvr_grid_count(const esvr_file* file);

/// Number of grids that the file carries as the bytes that OpenVDB wrote. They can be decoded with
/// OpenVDB only (esvr2vdb).
size_t esvr_carried_count(const esvr_file* file);
/// The name of such a grid; "" if the number is too large.
const char* esvr_carried_name(const esvr_file* file, size_t carried);

typedef enum esvr_class {
  ESVR_CLASS_UNKNOWN = 0,
  ESVR_CLASS_LEVEL_SET = 1,
  ESVR_CLASS_FOG_VOLUME = 2,
  ESVR_CLASS_STAGGERED = 3
} esvr_class;

typedef struct esvr_grid {
  size_t size;             ///< sizeof(esvr_grid), set by the caller
  const char* name;        ///< valid until the file is closed; not necessarily unique
  int32_t grid_class;      ///< an esvr_class
  int32_t has_transform;   ///< whether `transform` is there; a frustum has none
  double transform[16];    ///< world = [i j k 1] * M, row major
  float background;        ///< value of inactive voxels
  float low, high;         ///< range of the active voxels of the source
  int32_t box[6];          ///< bounding box of the active voxels: x0, y0, z0, x1, y1, z1, inclusive
  uint64_t active_voxels;  ///< number of active voxels of the source
  uint64_t ellipsoids;     ///< 0: the voxels themselves are stored
  int32_t has_residual;    ///< voxels are the sum of the ellipsoids and a correction
  float tone;              ///< s above 0: a value is s sinh(sum / s) of the sum; 0: it is the sum
  uint64_t nonfinite;      ///< active voxels that are NaN or infinite, and come back so
} esvr_grid;

/// Describes a grid.
esvr_status esvr_get_grid(const esvr_file* file, size_t grid, esvr_grid* description);

/// An ellipsoid adds intensity * phi(m) with m = |S^-1 R^T (x - center)|^2 (docs/format.md).
typedef struct esvr_ellipsoid {
  double center[3];
  float scale[3];     ///< the diagonal of S, voxels
  float rotation[4];  ///< unit quaternion w, x, y, z of R
  float intensity;
  float kappa;  ///< edge of the kernel phi
} esvr_ellipsoid;

/// Copies ellipsoids of a grid.
/// \param first, count  which of them; ESVR_USAGE if they are not all there
/// \param ellipsoids    output, `count` of them
esvr_status esvr_get_ellipsoids(const esvr_file* file, size_t grid, uint64_t first, uint64_t count,
                                esvr_ellipsoid* ellipsoids);

/// Evaluates the sum of a grid's ellipsoids, as a value by the tone curve if there is one, and clamped to the range of the source where the file says
/// so, at any places. A fit constrains the sum at voxels only; esvr_sample interpolates between them.
/// ESVR_USAGE for a grid that stores voxels, a residual or voxels that are not finite; esvr_sample serves those.
/// \param places  x, y and z of each place
/// \param values  output, one for each place
esvr_status esvr_evaluate(const esvr_file* file, size_t grid, size_t count, const double* places,
                          float* values);

/// Decodes the voxels of a grid, or those in a box.
/// \param box         x0, y0, z0, x1, y1, z1, inclusive; null: all voxels
/// \param max_memory  limit on the bytes that this may take, as for esvr_open
/// \param volume      output; null on failure
esvr_status esvr_decode(const esvr_file* file, size_t grid, const int32_t* box, uint64_t max_memory,
                        esvr_volume** volume);
void esvr_free_volume(esvr_volume* volume);

/// Decodes the voxels of a box into an array of the caller.
/// \param box     as for esvr_decode, not null and not empty
/// \param values  output: value of each voxel, z fastest, then y; the background where it is inactive
/// \param active  output: 1 for active voxels and 0 for others, in the same order; may be null
esvr_status esvr_decode_box(const esvr_file* file, size_t grid, const int32_t* box,
                            uint64_t max_memory, float* values, uint8_t* active);

/// The number of bricks of 8 x 8 x 8 voxels that have active voxels.
size_t esvr_brick_count(const esvr_volume* volume);

/// A brick of a volume. The pointers are valid until the volume is freed.
typedef struct esvr_brick {
  int32_t corner[3];       ///< its first voxel; multiples of 8
  const float* values;     ///< 512 values; voxel (x, y, z) of the brick is number 64 x + 8 y + z
  const uint64_t* active;  ///< bit 8 y + z of word x: whether a voxel is active
} esvr_brick;

/// \param brick  number of the brick; bricks are in increasing order of x, y and z
esvr_status esvr_get_brick(const esvr_volume* volume, size_t brick, esvr_brick* description);

/// Interpolates the voxels of a volume trilinearly. The value is the background outside of it, and not finite beside a
/// voxel that is not.
/// \param places  x, y and z of each place
/// \param values  output, one for each place
esvr_status esvr_sample(const esvr_volume* volume, size_t count, const double* places,
                        float* values);

#ifdef __cplusplus
}
#endif
#endif
