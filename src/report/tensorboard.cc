#include "report/tensorboard.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "base/check.h"
#include "base/csv.h"

namespace o2v {
namespace {

/// The number's bytes, the lowest first.
template <typename Word>
std::string Bytes(Word word) {
  std::string bytes(sizeof word, '\0');
  for (std::size_t i = 0; i < sizeof word; ++i) bytes[i] = static_cast<char>(word >> (8 * i));
  return bytes;
}

std::string MaskedCrc(std::string_view bytes) {
  return Bytes(std::rotr(Crc32c(bytes), 15) + 0xa282ead8u);  // the mask of the format
}

// ---- Protocol buffers

enum WireType { kVarint = 0, kFixed64 = 1, kLengthDelimited = 2, kFixed32 = 5 };

/// Seven bits a byte, the lowest first; the top bit says that more follow.
std::string Varint(std::uint64_t x) {
  std::string bytes;
  for (; x >= 128; x >>= 7) bytes += static_cast<char>(x | 128);
  return bytes + static_cast<char>(x);
}

std::string Key(unsigned field, WireType type) { return Varint(field << 3 | type); }

std::string Message(unsigned field, std::string_view text) {
  return Key(field, kLengthDelimited) + Varint(text.size()).append(text);
}

std::string Double(unsigned field, double x) {
  return Key(field, kFixed64) + Bytes(std::bit_cast<std::uint64_t>(x));
}

// ---- Tables

/// A table of the run; no columns where there is no file.
CsvTable ReadLog(const std::filesystem::path& path) {
  return std::filesystem::exists(path) ? ReadCsv(path, {.rows = true, .cells = true}) : CsvTable{};
}

/// Wall seconds at steps.
class Clock {
 public:
  explicit Clock(const CsvTable& timing) {
    if (timing.columns.empty()) return;
    const std::size_t step = timing.Column("step"), wall = timing.Column("wall_s");
    for (std::size_t row = 0; row < timing.Rows(); ++row) {
      steps_.push_back(timing.At(row, step));
      walls_.push_back(timing.At(row, wall));
    }
  }
  double At(double step) const {
    if (steps_.empty()) return 0;
    const auto found = std::lower_bound(steps_.begin(), steps_.end(), step);
    return found == steps_.end() ? walls_.back() : walls_[std::size_t(found - steps_.begin())];
  }

 private:
  std::vector<double> steps_, walls_;
};

}  // namespace

std::uint32_t Crc32c(std::string_view bytes) {
  static const std::array<std::uint32_t, 256> table = [] {
    std::array<std::uint32_t, 256> t;
    for (std::uint32_t i = 0; i < 256; ++i) {
      t[i] = i;
      for (int bit = 0; bit < 8; ++bit) t[i] = (t[i] >> 1) ^ (t[i] & 1 ? 0x82f63b78u : 0);
    }
    return t;
  }();
  std::uint32_t crc = ~0u;
  for (const char c : bytes) crc = (crc >> 8) ^ table[(crc ^ static_cast<unsigned char>(c)) & 255];
  return ~crc;
}

std::string TfRecord(std::string_view data) {
  const std::string length = Bytes(std::uint64_t{data.size()});
  return (length + MaskedCrc(length)).append(data) + MaskedCrc(data);
}

std::string VersionEvent() { return Double(1, 0) + Message(3, "brain.Event:2"); }

std::string ScalarEvent(double wall_time, std::int64_t step, std::string_view tag, float value) {
  const std::string number = Key(2, kFixed32) + Bytes(std::bit_cast<std::uint32_t>(value));
  return Double(1, wall_time) + Key(2, kVarint) + Varint(static_cast<std::uint64_t>(step)) +
         Message(5, Message(1, Message(1, tag) + number));
}

std::string EventFile(const std::filesystem::path& run) {
  if (!std::filesystem::is_regular_file(run / "episodes.csv")) {
    throw ConfigError(run.string() + ": not the folder of a run: it has no episodes.csv");
  }
  const Clock clock(ReadLog(run / "timing.csv"));
  std::string text = TfRecord(VersionEvent());
  for (const std::string name : {"episodes", "updates", "evals", "timing"}) {
    const CsvTable table = ReadLog(run / (name + ".csv"));
    if (table.columns.empty()) continue;
    const std::size_t step = table.Column("step");
    for (std::size_t row = 0; row < table.Rows(); ++row) {
      const double at = table.At(row, step);
      for (std::size_t column = 0; column < table.columns.size(); ++column) {
        const float value = static_cast<float>(table.At(row, column));
        if (column == step || !std::isfinite(value)) continue;
        text += TfRecord(
            ScalarEvent(clock.At(at), std::int64_t(at), name + "/" + table.columns[column], value));
      }
    }
  }
  return text;
}

}  // namespace o2v
