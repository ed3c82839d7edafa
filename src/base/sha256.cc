#include "base/sha256.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace o2v {
namespace {

using Word = std::uint32_t;
constexpr std::size_t kBlock = 64;  // [bytes]

/// The first 32 bits of the fractional parts of the square roots of the first 8 primes, and of the
/// cube roots of the first 64.
struct Constants {
  std::array<Word, 8> start;
  std::array<Word, 64> round;

  Constants() {
    const auto fraction = [](double x) { return Word((x - std::floor(x)) * 0x1p32); };
    std::size_t n = 0;
    for (int p = 2; n < round.size(); ++p) {
      bool prime = true;
      for (int d = 2; d * d <= p; ++d) prime = prime && p % d != 0;
      if (!prime) continue;
      if (n < start.size()) start[n] = fraction(std::sqrt(p));
      round[n++] = fraction(std::cbrt(p));
    }
  }
};

Word Rotated(Word x, int a, int b, int c) {
  return std::rotr(x, a) ^ std::rotr(x, b) ^ std::rotr(x, c);
}

void Compress(const Constants& constants, const char* block, std::array<Word, 8>& hash) {
  std::array<Word, 64> w;
  for (std::size_t t = 0; t < 16; ++t) {
    w[t] = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      w[t] = w[t] << 8 | static_cast<unsigned char>(block[4 * t + i]);
    }
  }
  for (std::size_t t = 16; t < 64; ++t) {
    const Word far = w[t - 15], near = w[t - 2];
    w[t] = (std::rotr(near, 17) ^ std::rotr(near, 19) ^ near >> 10) + w[t - 7] +
           (std::rotr(far, 7) ^ std::rotr(far, 18) ^ far >> 3) + w[t - 16];
  }
  auto [a, b, c, d, e, f, g, h] = hash;
  for (std::size_t t = 0; t < 64; ++t) {
    const Word choice = (e & f) ^ (~e & g), majority = (a & b) ^ (a & c) ^ (b & c);
    const Word t1 = h + Rotated(e, 6, 11, 25) + choice + constants.round[t] + w[t];
    const Word t2 = Rotated(a, 2, 13, 22) + majority;
    h = g, g = f, f = e, e = d + t1;
    d = c, c = b, b = a, a = t1 + t2;
  }
  const std::array<Word, 8> added = {a, b, c, d, e, f, g, h};
  for (std::size_t i = 0; i < 8; ++i) hash[i] += added[i];
}

}  // namespace

std::string Sha256(std::string_view bytes) {
  const Constants constants;
  std::array<Word, 8> hash = constants.start;
  const std::size_t whole = bytes.size() / kBlock * kBlock;
  for (std::size_t at = 0; at < whole; at += kBlock) Compress(constants, &bytes[at], hash);
  // The rest, a one bit, zeros, and the length [bits] in eight bytes fill whole blocks.
  std::string rest(bytes.substr(whole));
  rest += '\x80';
  while (rest.size() % kBlock != kBlock - 8) rest += '\0';
  const std::uint64_t bits = 8 * std::uint64_t(bytes.size());
  for (int shift = 56; shift >= 0; shift -= 8) rest += char(bits >> shift & 0xff);
  for (std::size_t at = 0; at < rest.size(); at += kBlock) Compress(constants, &rest[at], hash);

  std::string text;
  for (const Word word : hash) {
    for (int shift = 28; shift >= 0; shift -= 4) text += "0123456789abcdef"[word >> shift & 15];
  }
  return text;
}

}  // namespace o2v
