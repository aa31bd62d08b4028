#pragma once
/// The library's parsing of text (core/parse_text.h), under the programs' names.

#include "core/parse_text.h"

namespace esvr::cli {

using esvr::LeadingNumber;
using esvr::parseLeadingNumber;
using esvr::parseNumber;
using esvr::parseWhole;
using esvr::splitText;

}  // namespace esvr::cli
