#pragma once
/// The options of esvr-render by subject. For each subject, one function adds the options to the
/// command line and one reads them. The latter throws a UsageError if an option is wrong.

#include "cli/command_line.h"
#include "render/options.h"

namespace esvr::render {

/// The transfer function and its range, and the further grids with theirs. The options of the
/// picture and of the device are read before.
void addTransferOptions(cli::po::options_description& options);
void readTransferOptions(const cli::Arguments& a, Options& options);

/// The rays, the part of the volume that they pass, and the picture's form.
void addPictureOptions(cli::po::options_description& options);
void readPictureOptions(const cli::Arguments& a, Options& options);

/// The camera and its turntable.
void addCameraOptions(cli::po::options_description& options);
void readCameraOptions(const cli::Arguments& a, Options& options);

/// The device and the method that draw.
void addDeviceOptions(cli::po::options_description& options);
void readDeviceOptions(const cli::Arguments& a, Options& options);

/// Comparisons with a reference and measurements of speed. The output and the options of the
/// picture are read before.
void addMeasuringOptions(cli::po::options_description& options);
void readMeasuringOptions(const cli::Arguments& a, Options& options);

}  // namespace esvr::render
