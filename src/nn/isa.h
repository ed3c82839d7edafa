#pragma once
// Instruction sets of the loops that are compiled for more than one (nn/product_loops.h).

#include <optional>
#include <string>

namespace o2v {

/// kV3: registers of 32 bytes, what the whole program is built for (x86-64-v3 in a release).
/// kV4: of 64 bytes, AVX-512 (x86-64-v4). Results are the same bits.
enum class Isa { kV3, kV4 };
std::string ToString(Isa isa);  // "v3"

/// Whether processor and system have x86-64-v4.
bool HasV4();
/// What the value of O2V_ISA asks for, nothing when it is null. Throws ConfigError when it is
/// neither v3 nor v4, or v4 where that is not to be had.
std::optional<Isa> ReadIsa(const char* value, bool has_v4);
/// What O2V_ISA asks for, or what is faster here: there are processors that take a wide register
/// in two halves. Looked up or measured at the first call, which takes about 0.1 ms.
Isa ChosenIsa();

}  // namespace o2v
