#include "compare/unfitted.h"

#include <utility>

#include "esvr/sparse_volume.h"

namespace esvr::compare {
namespace {

constexpr const char* kDouble = "double";

std::string lineOf(const GridPair& pair) { return "grid \"" + pair.a().uniqueName + "\": "; }

/// True if two grids have the same bytes wherever they are in their files.
bool haveSameBytes(CarriedGrid a, CarriedGrid b) {
  a.place = b.place = 0;
  return a == b;
}

/// Compares two grids of floats or doubles, of which the reference has no active voxel.
void compareEmpty(const CheckOptions& options, const GridPair& pair, CheckRecord& record) {
  const VolumeGrid a = pair.reference.read(pair.ofReference);
  const VolumeGrid b = pair.candidate.read(pair.ofCandidate);
  if (const auto voxels = activeVoxelCount(b.volume); voxels > 0)
    record.failures.push_back(lineOf(pair) + "the candidate has " + std::to_string(voxels) +
                              " active voxels, the reference has none");
  else
    record.same.push_back(lineOf(pair) + "no active voxel in either file");
  auto differences = compareDescriptors(a.descriptor, b.descriptor);
  for (auto& difference : compareInactive(a.inactive, b.inactive))
    differences.push_back(std::move(difference));
  for (const auto& difference : differences) {
    const bool fails = options.failOn.contains(difference.kind);
    (fails ? record.failures : record.notes).push_back(lineOf(pair) + difference.text);
  }
}

}  // namespace

bool haveSameBytes(const GridPair& pair) {
  if (!pair.reference.hasBytes(pair.ofReference) || !pair.candidate.hasBytes(pair.ofCandidate))
    return false;
  const bool areVdb = !pair.reference.esvr() && !pair.candidate.esvr();
  if (areVdb && pair.a().storedBytes != pair.b().storedBytes) return false;
  const auto a = pair.reference.bytesOf(pair.ofReference);
  const auto b = pair.candidate.bytesOf(pair.ofCandidate);
  return a && b && haveSameBytes(*a, *b);
}

bool isRetyped(const GridPair& pair) {
  if (!pair.a().comparable || !pair.b().comparable) return pair.a().valueType != pair.b().valueType;
  return (pair.a().valueType == kDouble) != (pair.b().valueType == kDouble);
}

std::string retypedText(const GridPair& pair) {
  return lineOf(pair) + "its values are of type " + pair.b().valueType + " in the candidate, " +
         pair.a().valueType + " in the reference";
}

void compareUnfitted(const CheckOptions& options, const GridPair& pair, CheckRecord& record) {
  const auto a = pair.reference.bytesOf(pair.ofReference);
  const auto b = pair.candidate.bytesOf(pair.ofCandidate);
  if (a && b && haveSameBytes(*a, *b))
    record.same.push_back(lineOf(pair) + "the same bytes (" + pair.a().valueType + ")");
  else if (pair.a().comparable)
    compareEmpty(options, pair, record);
  else if (a && b)
    record.failures.push_back(lineOf(pair) + "its bytes differ; its values are of type " +
                              pair.a().valueType + ", which is compared bit for bit");
  else
    record.skipped.push_back(lineOf(pair) + "its values are of type " + pair.a().valueType);
}

}  // namespace esvr::compare
