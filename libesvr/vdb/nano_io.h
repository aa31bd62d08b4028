#pragma once
/// NanoVDB's readers and writers of files. They are templates that depend on these macros, so every
/// source file includes them through this header. Otherwise a program could contain two different
/// definitions of one function.

#include "vdb/versions.h"

#define NANOVDB_USE_OPENVDB
#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC
#include ESVR_NANOVDB_IO
