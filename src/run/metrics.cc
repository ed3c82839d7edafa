#include "run/metrics.h"

#include <algorithm>
#include <bit>

#include "base/check.h"
#include "base/csv.h"
#include "base/decimal.h"
#include "base/files.h"
#include "base/hash.h"

namespace o2v {
namespace {

constexpr char kEpisodesHeader[] = "step,worker,return,length,terminated,truncated";
constexpr int kSmoothing = 20;  // episodes; the authors' plotting scripts

std::string UpdatesHeader(const std::vector<std::string>& stat_names) {
  std::string header = "step";
  for (const std::string& name : stat_names) header += "," + name;
  return header;
}

}  // namespace

CsvLog::CsvLog(std::filesystem::path path, std::string header)
    : path_(std::move(path)), header_(std::move(header)) {}

void CsvLog::Append(const std::string& line) {
  pending_ += line;
  bytes_ += static_cast<std::int64_t>(line.size());
  hash_ = std::bit_cast<std::int64_t>(Fnv1a(line, std::bit_cast<std::uint64_t>(hash_)));
}

void CsvLog::Create() {
  WriteFileAtomically(path_, "");
  pending_.clear();
  bytes_ = 0;
  hash_ = std::bit_cast<std::int64_t>(Fnv1a(""));
  Append(header_ + "\n");
}

void CsvLog::Resume() {
  const std::string text = ReadFile(path_);
  const auto size = static_cast<std::int64_t>(text.size());
  Check(0 <= bytes_ && bytes_ <= size, path_.string(), ": ", size,
        " bytes, but the checkpoint was written after ", bytes_);
  const std::string_view kept(text.data(), static_cast<std::size_t>(bytes_));
  Check(std::bit_cast<std::int64_t>(Fnv1a(kept)) == hash_, path_.string(), ": the first ", bytes_,
        " bytes have changed since the checkpoint was written");
  Check(kept.starts_with(header_ + "\n"), path_.string(), ": its columns are not ", header_,
        "; another version of the program began it");
  std::filesystem::resize_file(path_, static_cast<std::uintmax_t>(bytes_));
  AppendToFile(path_, "");  // an error of writing shows before the first step
}

void CsvLog::Row(const std::vector<std::string>& cells) {
  std::string line;
  for (const std::string& cell : cells) line += (line.empty() ? "" : ",") + cell;
  Append(line + "\n");
}

void CsvLog::Flush() {
  AppendToFile(path_, pending_);
  pending_.clear();
  SyncFile(path_);
}

void CsvLog::Serialize(StateVisitor& v, const std::string& prefix) {
  v.Count(prefix + ".bytes", bytes_);
  v.Int(prefix + ".hash", hash_);
}

RunLogs::RunLogs(const std::filesystem::path& dir, const std::vector<std::string>& stat_names,
                 bool evals)
    : episodes_(dir / "episodes.csv", kEpisodesHeader),
      updates_(dir / "updates.csv", UpdatesHeader(stat_names)),
      sums_(VecD::Zero(Index(stat_names.size()))),
      ns_(sums_) {
  if (evals) evals_.emplace_back(dir / "evals.csv", "step,episode,return");
}

void RunLogs::Create() {
  episodes_.Create();
  updates_.Create();
  for (CsvLog& log : evals_) log.Create();
}

void RunLogs::Resume() {
  episodes_.Resume();
  updates_.Resume();
  for (CsvLog& log : evals_) log.Resume();
}

void RunLogs::AddEpisode(const Episode& e) {
  episodes_.Row({Decimal(e.step), Decimal(e.worker), Decimal(e.ret), Decimal(e.length),
                 Decimal(e.terminated), Decimal(e.truncated)});
}

void RunLogs::AddUpdate(std::int64_t step, std::span<const SumAndCount> statistics) {
  Check(Index(statistics.size()) == sums_.size(), "updates.csv: got ", statistics.size(),
        " numbers for ", sums_.size(), " columns");
  for (std::size_t i = 0; i < statistics.size(); ++i) {
    sums_(Index(i)) += statistics[i].sum;
    ns_(Index(i)) += statistics[i].n;
  }
  step_ = step;
  if (step_ - row_step_ >= kRowSteps) EndUpdates();
}

void RunLogs::EndUpdates() {
  if (step_ == row_step_) return;
  std::vector<std::string> cells = {Decimal(step_)};
  for (Index i = 0; i < sums_.size(); ++i) {
    cells.push_back(Decimal(SumAndCount{sums_(i), ns_(i)}.Value()));
  }
  updates_.Row(cells);
  row_step_ = step_;
  sums_.setZero();
  ns_.setZero();
}

void RunLogs::AddEval(std::int64_t step, int episode, double ret) {
  for (CsvLog& log : evals_) log.Row({Decimal(step), Decimal(episode), Decimal(ret)});
}

void RunLogs::Flush() {
  episodes_.Flush();
  updates_.Flush();
  for (CsvLog& log : evals_) log.Flush();
}

void RunLogs::Serialize(StateVisitor& v) {
  episodes_.Serialize(v, "episodes");
  updates_.Serialize(v, "updates");
  v.Count("updates.row_step", row_step_);
  v.Count("updates.step", step_);
  v.Doubles("updates.sums", sums_);
  v.Doubles("updates.ns", ns_);
  for (CsvLog& log : evals_) log.Serialize(v, "evals");
}

std::vector<CurvePoint> ReadEpisodes(const std::filesystem::path& path) {
  std::vector<CurvePoint> episodes;
  const CsvTable table = ReadCsv(path, {.rows = true});  // none before the first episode has ended
  const std::size_t step = table.Column("step"), ret = table.Column("return");
  for (std::size_t row = 0; row < table.Rows(); ++row) {
    episodes.emplace_back(static_cast<std::int64_t>(table.At(row, step)), table.At(row, ret));
  }
  return episodes;
}

CsvTable ReadUpdates(const std::filesystem::path& path) {
  CsvTable table = ReadCsv(path, {.rows = true});
  return table.Rows() > 0 ? std::move(table) : CsvTable{};
}

std::vector<CurvePoint> SmoothedReturns(std::span<const CurvePoint> episodes) {
  std::vector<CurvePoint> curve;
  for (std::size_t end = kSmoothing; end <= episodes.size(); ++end) {
    double sum = 0;
    for (const auto& [step, ret] : episodes.subspan(end - kSmoothing, kSmoothing)) sum += ret;
    curve.emplace_back(episodes[end - 1].first, sum / kSmoothing);
  }
  return curve;
}

}  // namespace o2v
