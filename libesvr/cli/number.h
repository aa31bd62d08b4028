#pragma once
/// The library's functions that parse text (core/parse_text.h), in the namespace of the programs.

#include "core/parse_text.h"

namespace esvr::cli {

using esvr::LeadingNumber;
using esvr::parseLeadingNumber;
using esvr::parseNumber;
using esvr::parseWhole;
using esvr::splitText;

}  // namespace esvr::cli
