#include "vdb/make_nano.h"

#include <stdexcept>
#include <type_traits>

#include "vdb/trees.h"

#include ESVR_NANOVDB_CREATE

namespace esvr::vdb {
namespace {

#ifdef ESVR_NANOVDB_HAS_CREATE
template <class Build, class Grid>
NanoHandle converted(const Grid& grid, float tolerance) {
  nanotools::CreateNanoGrid<Grid> create(grid);
  if constexpr (std::is_same_v<Build, nanovdb::FpN>)
    return create.template getHandle<Build>(nanotools::AbsDiff(tolerance));
  else
    return create.template getHandle<Build>();
}
#else
template <class Build, class Grid>
NanoHandle converted(const Grid& grid, float tolerance) {
  nanovdb::OpenToNanoVDB<typename Grid::ValueType, Build> create;
  if constexpr (std::is_same_v<Build, nanovdb::FpN>) create.oracle() = nanovdb::AbsDiff(tolerance);
  return create(grid);
}
#endif

NanoHandle makeNano(const openvdb::FloatGrid& grid, const NanoForm& form) {
  switch (form.values) {
    case NanoValues::kFloat:
      return converted<float>(grid, form.tolerance);
    case NanoValues::kFp4:
      return converted<nanovdb::Fp4>(grid, form.tolerance);
    case NanoValues::kFp8:
      return converted<nanovdb::Fp8>(grid, form.tolerance);
    case NanoValues::kFp16:
      return converted<nanovdb::Fp16>(grid, form.tolerance);
    case NanoValues::kFpN:
      return converted<nanovdb::FpN>(grid, form.tolerance);
  }
  throw std::logic_error("makeNano: no such values");
}

}  // namespace

NanoHandle makeNano(const openvdb::GridBase& grid, const NanoForm& form) {
  if (grid.isType<openvdb::FloatGrid>())
    return makeNano(static_cast<const openvdb::FloatGrid&>(grid), form);
  if (grid.isType<openvdb::DoubleGrid>() && form.values == NanoValues::kFloat)
    return converted<double>(static_cast<const openvdb::DoubleGrid&>(grid), form.tolerance);
  throw std::logic_error("makeNano: a grid of " + grid.valueType());
}

}  // namespace esvr::vdb
