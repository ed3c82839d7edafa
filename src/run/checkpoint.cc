#include "run/checkpoint.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <vector>

#include "base/check.h"
#include "base/files.h"
#include "base/hash.h"

namespace o2v {
namespace {

using nlohmann::json;
using RealRowMajor = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

static_assert(std::endian::native == std::endian::little, "safetensors data is little-endian");

constexpr std::string_view kFormatName = "option2vec-";
constexpr std::string_view kFormat = "option2vec-1";  // of the whole training state
constexpr std::string_view kRealType = sizeof(Real) == 4 ? "F32" : "F64";
constexpr std::size_t kLengthBytes = 8;  // of the header's length; safetensors layout
constexpr char kMetadataKey[] = "__metadata__";

struct Tensor {
  std::string type;
  std::uint64_t rows = 0, cols = 0;
  std::string_view bytes;  // row-major

  bool HasShape(Index r, Index c) const {
    return rows == static_cast<std::uint64_t>(r) && cols == static_cast<std::uint64_t>(c);
  }
};

std::size_t Width(std::string_view type) { return type == "F32" ? 4 : 8; }

/// A parsed file. The tensors point into `text`.
struct File {
  std::string path, text;
  Metadata metadata;  // of one of ours
  std::map<std::string, Tensor> tensors;
  bool ours = false;  // written by SaveCheckpoint

  template <typename... Parts>
  void Require(bool ok, const Parts&... parts) const {
    Check(ok, path, ": ", parts...);
  }
};

std::string Hex(std::uint64_t x) {
  std::ostringstream out;
  out << std::hex << std::setfill('0') << std::setw(16) << x;
  return out.str();
}

/// Of everything but the checksum itself; independent of the order of the data.
std::string Checksum(const Metadata& metadata, const std::map<std::string, Tensor>& tensors) {
  std::uint64_t h = Fnv1a("");
  for (const auto& [key, value] : metadata) {
    if (key != "checksum") h = Fnv1a(value, Fnv1a(key + '=', h));
  }
  for (const auto& [name, t] : tensors) {
    h = Fnv1a(t.bytes, Fnv1a(Concat(name, ' ', t.type, ' ', t.rows, ' ', t.cols, '='), h));
  }
  return Hex(h);
}

/// One entry of the header; `data` is the whole data section.
Tensor ParseTensor(const File& file, const std::string& name, const json& entry,
                   std::string_view data) {
  const auto pair = [&](const char* key) {
    const json& x = entry.at(key);
    file.Require(
        x.is_array() && x.size() == 2 && x[0].is_number_unsigned() && x[1].is_number_unsigned(),
        name, ": '", key, "' is not a pair of whole numbers");
    return std::pair(x[0].get<std::uint64_t>(), x[1].get<std::uint64_t>());
  };
  file.Require(entry.is_object() && entry.size() == 3, name,
               ": the header entry is not {dtype, shape, data_offsets}");
  Tensor t;
  t.type = entry.at("dtype").get<std::string>();
  file.Require(t.type == "F32" || t.type == "F64" || t.type == "I64", name, ": type ", t.type,
               " is not F32, F64 or I64");
  std::tie(t.rows, t.cols) = pair("shape");
  const auto [begin, end] = pair("data_offsets");
  file.Require(begin <= end && end <= data.size(), name, ": data [", begin, ", ", end,
               ") is not inside the ", data.size(), " bytes of data");
  t.bytes = data.substr(begin, end - begin);
  const std::uint64_t width = Width(t.type), count = t.bytes.size() / width;
  const bool empty = t.rows == 0 || t.cols == 0;
  file.Require(t.bytes.size() % width == 0 &&
                   (empty ? count == 0 : count % t.rows == 0 && count / t.rows == t.cols),
               name, ": ", t.bytes.size(), " bytes are not ", t.type, " (", t.rows, ", ", t.cols,
               ")");
  return t;
}

/// Every byte of the data must belong to exactly one tensor.
void RequireNoGaps(const File& file, std::string_view data) {
  std::vector<std::string_view> blocks;
  for (const auto& [name, t] : file.tensors) blocks.push_back(t.bytes);
  std::sort(blocks.begin(), blocks.end(), [](std::string_view a, std::string_view b) {
    return std::pair(a.data(), a.size()) < std::pair(b.data(), b.size());
  });
  const char* end = data.data();
  for (const std::string_view block : blocks) {
    file.Require(block.data() == end, "tensors overlap or leave a gap at byte ",
                 std::min(block.data(), end) - data.data(), " of the data");
    end = block.data() + block.size();
  }
  file.Require(end == data.data() + data.size(), data.data() + data.size() - end,
               " bytes of data belong to no tensor");
}

/// A JSON text without a name that stands twice in an object.
json ParseJson(const File& file, std::string_view text) {
  std::vector<std::set<std::string>> open;  // names of the objects around
  return json::parse(text, [&](int, json::parse_event_t event, json& x) {
    if (event == json::parse_event_t::object_start) open.emplace_back();
    if (event == json::parse_event_t::object_end) open.pop_back();
    if (event == json::parse_event_t::key) {
      const auto name = x.get<std::string>();
      file.Require(open.back().insert(name).second, "bad header: ", name, " appears twice");
    }
    return true;
  });
}

File ParseFile(const std::filesystem::path& path) {
  File file{path.string(), ReadFile(path), {}, {}, false};
  const std::string_view text = file.text;
  std::uint64_t length = 0;
  file.Require(text.size() >= kLengthBytes, "not a checkpoint: ", text.size(), " bytes");
  std::memcpy(&length, text.data(), kLengthBytes);
  file.Require(length <= text.size() - kLengthBytes, "not a whole checkpoint: a header of ", length,
               " bytes in a file of ", text.size());
  const std::string_view header = text.substr(kLengthBytes, length);
  const std::string_view data = text.substr(kLengthBytes + length);
  try {
    const json entries = ParseJson(file, header);
    file.Require(entries.is_object(), "the header is not a JSON object");
    for (const auto& [name, entry] : entries.items()) {
      if (name == kMetadataKey) {
        file.metadata = entry.get<Metadata>();
      } else {
        file.tensors.emplace(name, ParseTensor(file, name, entry, data));
      }
    }
  } catch (const json::exception& e) {
    file.Require(false, "not a checkpoint: bad header: ", e.what());
  }
  RequireNoGaps(file, data);
  const std::string format = file.metadata["format"];
  file.ours = format == kFormat;
  if (file.ours) {
    const std::string found = Checksum(file.metadata, file.tensors);
    const std::string said = file.metadata["checksum"];
    file.Require(found == said, "damaged: checksum ", found, ", not '", said, "'");
  } else {
    file.Require(!format.starts_with(kFormatName), "format ", format, "; this program reads ",
                 kFormat);
    file.metadata.clear();  // means something else elsewhere
  }
  return file;
}

/// Names of tensors in the file for those that Serialize functions use.
class Names {
 public:
  explicit Names(Learner& learner) {
    for (const Param* p : learner.Params()) params_.insert(p->name);
  }
  bool IsParam(std::string_view name) const { return params_.contains(name); }
  std::string InFile(std::string_view name) const {
    const bool plain = IsParam(name) || name.starts_with("normalizer.");
    return plain ? std::string(name) : "training." + std::string(name);
  }

 private:
  std::set<std::string, std::less<>> params_;
};

class Saver final : public StateVisitor {
 public:
  explicit Saver(const Names& names) : names_(names) {}

  void Matrix(std::string_view name, Mat& x) override {
    const RealRowMajor rows = x;
    Add(name, kRealType, x.rows(), x.cols(), rows.data());
  }
  void Doubles(std::string_view name, double* x, std::size_t n) override {
    Add(name, "F64", static_cast<Index>(n), 1, x);
  }
  void Ints(std::string_view name, std::int64_t* x, std::size_t n) override {
    Add(name, "I64", static_cast<Index>(n), 1, x);
  }

  bool Has(const std::string& name) const { return tensors_.contains(name); }

  /// The file's text. The data are in the order of the names, wide types first: all are aligned.
  std::string Text(Metadata metadata) const {
    metadata["format"] = kFormat;
    metadata["checksum"] = Checksum(metadata, tensors_);
    json header = {{kMetadataKey, metadata}};
    std::string data;
    for (const std::size_t width : {8, 4}) {
      for (const auto& [name, t] : tensors_) {
        if (Width(t.type) != width) continue;
        header[name] = {{"dtype", t.type},
                        {"shape", {t.rows, t.cols}},
                        {"data_offsets", {data.size(), data.size() + t.bytes.size()}}};
        data += t.bytes;
      }
    }
    std::string text = header.dump();
    text.append((kLengthBytes - text.size() % kLengthBytes) % kLengthBytes,
                ' ');  // aligns the data
    const std::uint64_t length = text.size();
    text.insert(0, reinterpret_cast<const char*>(&length), kLengthBytes);
    return text + data;
  }

 private:
  void Add(std::string_view name, std::string_view type, Index rows, Index cols, const void* data) {
    const std::string key = names_.InFile(name);
    Check(!Has(key), "checkpoint: two arrays are named ", name);
    const std::size_t size = static_cast<std::size_t>(rows * cols) * Width(type);
    Tensor& t = tensors_[key];
    t.type = type;
    t.rows = static_cast<std::uint64_t>(rows);
    t.cols = static_cast<std::uint64_t>(cols);
    t.bytes = bytes_[key] = std::string(static_cast<const char*>(data), size);
  }

  const Names& names_;
  std::map<std::string, std::string> bytes_;
  std::map<std::string, Tensor> tensors_;  // their data are in bytes_
};

/// Compares a walk with a file, or copies the file's values into it.
class Loader final : public StateVisitor {
 public:
  Loader(const File& file, const Names& names, bool copy)
      : file_(file), names_(names), copy_(copy) {}

  void Matrix(std::string_view name, Mat& x) override {
    const Tensor& t = Find(name, kRealType, x.rows(), x.cols());
    RealRowMajor rows(x.rows(), x.cols());
    Copy(t, rows.data());
    RequireFinite(name, rows.allFinite());
    if (copy_) x = rows;
  }
  void Doubles(std::string_view name, double* x, std::size_t n) override {
    const Tensor& t = Find(name, "F64", static_cast<Index>(n), 1);
    VecD values(static_cast<Index>(n));
    Copy(t, values.data());
    RequireFinite(name, values.allFinite());
    if (copy_) std::copy(values.begin(), values.end(), x);
  }
  void Ints(std::string_view name, std::int64_t* x, std::size_t n) override {
    const Tensor& t = Find(name, "I64", static_cast<Index>(n), 1);
    std::vector<std::int64_t> values(n);
    Copy(t, values.data());
    for (const std::int64_t value : values) {
      file_.Require(low_ <= value && value <= high_, names_.InFile(name), ": ", value,
                    " is not in [", low_, ", ", high_, "]");
    }
    Within(kLowest, kHighest);
    if (copy_) std::copy(values.begin(), values.end(), x);
  }
  void Within(std::int64_t low, std::int64_t high) override { low_ = low, high_ = high; }

  void RequireAllSeen() const {
    for (const auto& [name, t] : file_.tensors) {
      file_.Require(seen_.contains(name), "contains ", name, ", which this run does not have");
    }
  }

 private:
  static constexpr std::int64_t kLowest = std::numeric_limits<std::int64_t>::min(),
                                kHighest = std::numeric_limits<std::int64_t>::max();

  void RequireFinite(std::string_view name, bool finite) const {
    file_.Require(finite, names_.InFile(name), " has a value that is not finite");
  }
  const Tensor& Find(std::string_view name, std::string_view type, Index rows, Index cols) {
    const std::string key = names_.InFile(name);
    const auto it = file_.tensors.find(key);
    file_.Require(it != file_.tensors.end(), key, " is missing");
    const Tensor& t = it->second;
    file_.Require(t.type == type && t.HasShape(rows, cols), key, " is ", t.type, " (", t.rows, ", ",
                  t.cols, "), not ", type, " (", rows, ", ", cols, ")");
    seen_.insert(key);
    return t;
  }
  static void Copy(const Tensor& t, void* to) {
    if (!t.bytes.empty()) std::memcpy(to, t.bytes.data(), t.bytes.size());
  }

  const File& file_;
  const Names& names_;
  bool copy_;
  std::int64_t low_ = kLowest, high_ = kHighest;  // of the next whole numbers
  std::set<std::string, std::less<>> seen_;
};

/// A tensor of finite F32 or F64 numbers, wanted as (rows, cols).
MatD ReadReals(const File& file, const std::string& name, Index rows, Index cols) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto it = file.tensors.find(name);
  file.Require(it != file.tensors.end(), name, " is missing");
  const Tensor& t = it->second;
  file.Require(t.type != "I64" && t.HasShape(rows, cols), name, " is ", t.type, " (", t.rows, ", ",
               t.cols, "), not F32 or F64 (", rows, ", ", cols, ")");
  RowMajor x(rows, cols);
  for (Index i = 0; i < x.size(); ++i) {
    const char* from = t.bytes.data() + static_cast<std::size_t>(i) * Width(t.type);
    if (t.type == "F32") {
      float value;
      std::memcpy(&value, from, sizeof value);
      x.data()[i] = static_cast<double>(value);
    } else {
      std::memcpy(x.data() + i, from, sizeof(double));
    }
  }
  file.Require(x.allFinite(), name, " has a value that is not finite");
  return x;
}

}  // namespace

void SaveCheckpoint(const std::filesystem::path& path, Metadata metadata, Learner& learner,
                    const StateWalk& walk, const std::function<void()>& before_rename) {
  const Names names(learner);
  Saver saver(names);
  walk(saver);
  for (const Param* p : learner.Params()) {
    Check(saver.Has(p->name), "checkpoint: the method does not show ", p->name);
  }
  WriteFileAtomically(path, saver.Text(std::move(metadata)), before_rename);
}

void SavePolicy(const std::filesystem::path& path, const Metadata& metadata, Learner& learner,
                Normalizer& normalizer) {
  SaveCheckpoint(path, metadata, learner, [&](StateVisitor& v) {
    for (Param* p : learner.Params()) v.Matrix(p->name, p->value);
    normalizer.Serialize(v);
  });
}

Metadata LoadCheckpoint(const std::filesystem::path& path, Learner& learner,
                        const StateWalk& walk) {
  File file = ParseFile(path);
  file.Require(file.ours, "not a checkpoint of a run: its format is not ", kFormat);
  for (const char* added : {"format", "checksum"}) file.metadata.erase(added);
  const Names names(learner);
  Loader check(file, names, /*copy=*/false);
  walk(check);
  check.RequireAllSeen();
  Loader copy(file, names, /*copy=*/true);
  walk(copy);
  return file.metadata;
}

Metadata ReadMetadata(const std::filesystem::path& path) { return ParseFile(path).metadata; }

std::optional<std::int64_t> TotalSteps(const Metadata& metadata) {
  const auto found = metadata.find("total_steps");
  if (found == metadata.end()) return std::nullopt;
  const std::string& text = found->second;
  std::int64_t steps = 0;
  const auto [end, bad] = std::from_chars(text.data(), text.data() + text.size(), steps);
  Check(bad == std::errc() && end == text.data() + text.size(), "checkpoint: total_steps is '",
        text, "', not a whole number");
  return steps;
}

void LoadPolicy(const std::filesystem::path& path, Learner& learner, Normalizer& normalizer) {
  const File file = ParseFile(path);
  const Names names(learner);
  const std::set<std::string, std::less<>> statistics = {"normalizer.mean", "normalizer.var",
                                                         "normalizer.count"};
  for (const auto& [name, t] : file.tensors) {
    file.Require(names.IsParam(name) || statistics.contains(name) || name.starts_with("training."),
                 name, " is not a parameter of the method");
  }
  const std::vector<Param*> params = learner.Params();
  std::vector<Mat> values;
  for (const Param* p : params) {
    values.push_back(ReadReals(file, p->name, p->value.rows(), p->value.cols()).cast<Real>());
    file.Require(values.back().allFinite(), p->name, " has a value too large for this program");
  }
  const Index S = normalizer.mean().size();
  const VecD mean = ReadReals(file, "normalizer.mean", S, 1);
  const VecD var = ReadReals(file, "normalizer.var", S, 1);
  file.Require((var.array() >= 0).all(), "normalizer.var has a negative entry");
  const double count = file.tensors.contains("normalizer.count")
                           ? ReadReals(file, "normalizer.count", 1, 1)(0, 0)
                           : normalizer.count();
  for (std::size_t i = 0; i < params.size(); ++i) params[i]->value = values[i];
  normalizer.Set(mean, var, count);
}

std::filesystem::path FindCheckpoint(const std::filesystem::path& run) {
  if (!std::filesystem::exists(run))
    throw ConfigError(run.string() + ": no such folder or checkpoint");
  if (!std::filesystem::is_directory(run)) return run;
  const std::filesystem::path path = run / "last.ckpt";
  if (!std::filesystem::exists(path))
    throw ConfigError(run.string() + ": no last.ckpt in this folder");
  return path;
}

}  // namespace o2v
