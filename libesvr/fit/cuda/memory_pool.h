#pragma once
/// The pool that stream-ordered allocations come from.

namespace esvr::cuda {

/// Keeps freed memory of the current device in its pool: a fit allocates anew at every event, and
/// would else give the memory back and ask for it again at every synchronisation.
void keepFreedMemory();

}  // namespace esvr::cuda
