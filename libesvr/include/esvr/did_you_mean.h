#pragma once
/// What a message that refuses a mistyped word adds: the known word that is probably meant.

#include <span>
#include <string>
#include <string_view>

namespace esvr {

/// The end of a message that refuses a word, such as "; did you mean --max-error?": it names the known
/// word that is nearest by the letters to insert, leave out, replace or swap. At most a third of the
/// letters may be wrong, or the given word is the begin of the known one. Capitals, and underscores for
/// hyphens, do not count.
/// \param known  all words that would be taken; the first of the nearest ones is named
/// \param quote  stands before and behind the word
/// \return an empty text if no known word is near, or the given one is known
[[nodiscard]] std::string didYouMean(std::string_view given, std::span<const std::string> known,
                                     std::string_view quote = "");

}  // namespace esvr
