#pragma once
/// Grids of vectors, whose components are converted like grids of numbers.

#include <vector>

#include "vdb2esvr/options.h"
#include "vdb2esvr/records.h"

namespace esvr::vdb2esvr {

/// Makes the record's list of vectors from its converted grids. The vectors of which an interrupted
/// run converted some components only are not converted: these components are removed.
void collectVectors(RunRecord& record);

/// Carries the vectors that take fewer bytes unchanged than as converted components, unless an
/// option prescribes the representation or a size.
/// \param carried  the carried grids, by increasing places in the input; vectors are added
/// \throws  as for readCarried
void carrySmallerVectors(const Options& options, RunRecord& record,
                         std::vector<CarriedGrid>& carried);

/// Measures the errors of the vectors of the written file.
void measureVectors(const Options& options, const EsvrFile& file, RunRecord& record);

}  // namespace esvr::vdb2esvr
