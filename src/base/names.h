#pragma once
// Help with misspelt names.

#include <string>
#include <string_view>
#include <vector>

namespace o2v {

/// The up to three known names with the least Levenshtein distance to `name`, quoted and joined by
/// commas; for messages such as "unknown task 'Hoper-v2'; nearest: 'Hopper-v2'".
std::string Nearest(std::string_view name, const std::vector<std::string>& known);

}  // namespace o2v
