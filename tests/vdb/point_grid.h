#pragma once
/// A grid of points, as hosts write them beside volumes. Its templates take minutes to compile:
/// they are in one translation unit.

#include <openvdb/openvdb.h>

#include <string>

namespace esvr::test {

/// Two points.
openvdb::GridBase::Ptr pointGrid(const std::string& name);

}  // namespace esvr::test
