#pragma once
// Tables for the eye.

#include <string>
#include <vector>

namespace o2v {

/// Lines of cells as text with aligned columns two blanks apart.
std::string AlignColumns(const std::vector<std::vector<std::string>>& lines);

}  // namespace o2v
