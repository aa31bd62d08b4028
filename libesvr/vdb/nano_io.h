#pragma once
/// NanoVDB's readers and writers of files. They are templates whose code follows these macros, so
/// every source that uses them includes them here: two definitions of one function would otherwise
/// meet in a program.

#include "vdb/versions.h"

#define NANOVDB_USE_OPENVDB
#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC
#include ESVR_NANOVDB_IO
