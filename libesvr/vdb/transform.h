#pragma once
/// Index-to-world maps: from a file, from and to OpenVDB's objects.

#include "esvr/grid_descriptor.h"
#include "vdb/input_file.h"
#include "vdb/versions.h"

#include <openvdb/math/Transform.h>

namespace esvr::vdb {

/// Reads the transform that stands at the file's position. The stream is tagged with its version.
/// \throws BadInput  damaged, a map OpenVDB does not know
Transform readTransform(InputFile& file);

Transform fromMap(const openvdb::math::MapBase& map);

/// The simplest of OpenVDB's maps that equals an affine one.
/// \throws openvdb::ArithmeticError  singular, or not affine
Transform fromMatrix(const openvdb::math::Mat4d& matrix);

/// The very map that was read, not OpenVDB's simplification of it.
/// \throws BadInput  bytes that are no such map
openvdb::math::Transform::Ptr toOpenVdb(const Transform& transform);

}  // namespace esvr::vdb
