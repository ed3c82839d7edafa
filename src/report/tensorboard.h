#pragma once
// Curves of a run as an event file of TensorBoard: TFRecords, each a protocol buffer Event.
//
//   record   u64 length | u32 masked CRC of it | data | u32 masked CRC of the data, little-endian
//   Event    1: double wall_time | 2: int64 step | 3: string file_version | 5: Summary
//   Summary  1: Value, which is 1: string tag | 2: float simple_value

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace o2v {

/// CRC-32C (Castagnoli), as RFC 3720 has it.
std::uint32_t Crc32c(std::string_view bytes);

/// A record around `data`.
std::string TfRecord(std::string_view data);

/// The first event of a file, which says its version.
std::string VersionEvent();

/// An event with one number. `wall_time` [s].
std::string ScalarEvent(double wall_time, std::int64_t step, std::string_view tag, float value);

/// Event file of the run in the folder `run`: a tag a column of episodes.csv, updates.csv,
/// evals.csv and timing.csv, such as "episodes/return". The wall time of a step is that of the
/// first row of timing.csv at or after it, counted from the start of the run. Numbers are rounded
/// to float; cells that are empty or beyond its range are left out. Throws ConfigError where there
/// is no run.
std::string EventFile(const std::filesystem::path& run);

}  // namespace o2v
