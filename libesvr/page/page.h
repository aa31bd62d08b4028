#pragma once
/// What the exported page needs beside the C interface of the decoder (esvr/esvr.h): a description
/// of a file, voxels in the form of textures, the tables of a transfer function, and cameras. All of
/// it is the library's own code, so that the page draws what esvr-render draws.
///
/// The functions are called from JavaScript (src/local/decoder.js), which reads the structs. All their
/// members have four bytes there, pointers too. The caller frees texts by free().

#include "esvr/esvr.h"

extern "C" {

/// A JSON text: the member "grids" of a file in the viewer's protocol, with a usual look.
/// \return null on failure (esvr_error)
char* page_grids(const esvr_file* file);

/// A JSON text: the members "colormaps" and "opacities" of the viewer's description.
/// \return null on failure
char* page_looks();

/// Decodes a grid as drawing takes it: voxels that are NaN or infinite are empty. Everything below that takes a volume
/// takes one of these, whose values are all finite.
/// \param volume  output; freed by esvr_free_volume
esvr_status page_decode(const esvr_file* file, int grid, esvr_volume** volume);

/// Counts the active voxels of a volume in `count` intervals from `low` to `high`. Values outside
/// count in the first or the last one.
void page_histogram(const esvr_volume* volume, double low, double high, int count, double* counts);

/// The bricks of a volume that rays march through, as two textures.
///
/// Bricks have 8 x 8 x 8 cells and store the 9 x 9 x 9 voxels at their corners, as in the library
/// (render/brick_march.h). The atlas has room for slots[0] x slots[1] x slots[2] of them, x fastest;
/// a voxel is (value - background) / scale. The table has four bytes for each brick
/// of the box, x fastest: the place of its slot along x, y and z and 0, or 0, 0, 0 and the distance
/// in bricks, at least 1, within which all bricks are empty (the distance 1 is the brick itself).
struct page_atlas {
  int level;      ///< voxels are means of 2^level x 2^level x 2^level voxels
  int origin[3];  ///< first voxel of the table's first brick, in voxels of the level
  int bricks[3];  ///< size of the table
  int slots[3];   ///< size of the atlas
  int count;      ///< number of slots that are used
  float background;
  float scale;
  float least, most;  ///< smallest and largest stored voxel
  const unsigned char* table;
  const float* voxels;
};

/// \param level      coarser level of detail to begin with
/// \param most_side  largest side of a 3D texture, in voxels
/// \param most_bytes largest size of both textures together; a coarser level is taken if it is
///                   exceeded
/// \return null on failure
page_atlas* page_make_atlas(const esvr_volume* volume, int level, int most_side, double most_bytes);
void page_free_atlas(page_atlas* atlas);

/// A transfer function as points in rows of four numbers, as in the viewer's protocol.
struct page_transfer {
  int space;  ///< place in RGB, HSV, HSVWrap, Lab, Diverging, Step
  int color_count, opacity_count;
  const double* colors;   ///< value, red, green, blue
  const double* opacity;  ///< value, opacity, midpoint, sharpness
};

/// The tables of the library's renderers (render/transfer_table.h). Places count
/// intervals from the lowest value of the transfer function.
struct page_tables {
  int intervals;
  float low, scale;             ///< lowest value and intervals per unit; scale 0: no extent
  float weak_gradient_squared;  ///< the square of the gradient at which half of the shading is left
  float least_bend;             ///< intervals; SegmentTableView::leastBend
  const float* values;          ///< intervals + 1 times red, green, blue, alpha
  /// side x side times the light of a segment as red, green, blue and alpha, premultiplied. Entry
  /// (i, j), i fastest, is a segment from the value i to the value j of `side` values at equal distances
  /// from the first to the last. Null if no segments are wanted.
  const float* segments;
  float below[4], above[4];  ///< colors and extinctions beyond the ends; alpha is the extinction
};

/// What the tables are made for.
struct page_sampling {
  double length;       ///< length of a step in units of the length that opacities are given for
  double first, last;  ///< range of values of the table of segments
  int side;            ///< of the table of segments; 0: none is wanted
};

/// \return null on failure
page_tables* page_make_tables(const page_transfer* transfer, const page_sampling* sampling);
void page_free_tables(page_tables* tables);

/// Fits a camera to a box of voxels.
/// \param box        x0, y0, z0, x1, y1, z1
/// \param edges      of a voxel in the camera's space, three places; null: a cube
/// \param direction  from the middle to the eye; null: the usual view
/// \param camera     output: eye, center, up, and the field of view or the height
void page_fit(const int* box, const double* edges, const double* direction, int orthographic,
              int width, int height, double* camera);

/// Checks a camera: eye, center, up, and the field of view or the height.
esvr_status page_check_camera(const double* camera, int orthographic, int width, int height);
}
