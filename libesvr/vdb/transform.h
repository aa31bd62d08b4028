#pragma once
/// Reads index-to-world maps from files, and converts them from and to OpenVDB's objects.

#include "esvr/grid_descriptor.h"
#include "vdb/input_file.h"
#include "vdb/versions.h"

#include <openvdb/math/Transform.h>

namespace esvr::vdb {

/// Reads the transform at the position of the file. The stream must know the file's version.
/// \throws BadInput  the transform is damaged, or OpenVDB does not know its map
Transform readTransform(InputFile& file);

Transform fromMap(const openvdb::math::MapBase& map);

/// The simplest of OpenVDB's maps that equals an affine map.
/// \throws openvdb::ArithmeticError  the matrix is singular or not affine
Transform fromMatrix(const openvdb::math::Mat4d& matrix);

/// The map as it was read, without OpenVDB's simplification.
/// \throws BadInput  the bytes are not such a map
openvdb::math::Transform::Ptr toOpenVdb(const Transform& transform);

}  // namespace esvr::vdb
