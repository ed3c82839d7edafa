#include "base/rng.h"

#include <array>
#include <cmath>
#include <numbers>
#include <sstream>

#include "base/check.h"
#include "base/hash.h"

namespace o2v {
namespace {

/// libstdc++ writes the engine as 312 words and the position, in decimal, space separated.
constexpr std::size_t kEngineWords = std::mt19937_64::state_size + 1;

}  // namespace

Rng::Rng(std::uint64_t seed, std::string_view stream) {
  const std::uint64_t h = Fnv1a(stream);
  std::seed_seq seq{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                    static_cast<std::uint32_t>(h), static_cast<std::uint32_t>(h >> 32)};
  engine_.seed(seq);
}

double Rng::Normal() {
  const double u = 1 - Uniform(), v = Uniform();
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

std::uint64_t Rng::UniformInt(std::uint64_t n) {
  __extension__ using Wide = unsigned __int128;
  const std::uint64_t threshold = -n % n;  // 2^64 mod n
  for (;;) {
    const Wide product = static_cast<Wide>(engine_()) * n;
    if (static_cast<std::uint64_t>(product) >= threshold) {
      return static_cast<std::uint64_t>(product >> 64);
    }
  }
}

void Rng::Serialize(StateVisitor& v, std::string_view name) {
  std::array<std::int64_t, kEngineWords> words{};
  std::stringstream text;
  text << engine_;
  for (std::int64_t& w : words) {
    std::uint64_t u = 0;
    text >> u;
    w = static_cast<std::int64_t>(u);
  }
  v.Ints(name, words.data(), words.size());
  const std::int64_t position = words.back();
  Check(position >= 0 && position <= std::int64_t{std::mt19937_64::state_size}, "random stream ",
        name, ": position ", position, " of a generator of ", std::mt19937_64::state_size,
        " words");
  std::stringstream back;
  for (const std::int64_t w : words) back << static_cast<std::uint64_t>(w) << ' ';
  back >> engine_;
  Check(!back.fail(), "random stream ", name, ": not the state of a generator");
}

}  // namespace o2v
