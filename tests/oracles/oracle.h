#pragma once
// A method compared with a file of reference numbers: given parameters, one batch, and all that
// follows from them. The format is described in tests/data/oracles/README.md.

#include <cstddef>
#include <filesystem>
#include <string>

#include "algo/algorithm.h"
#include "nlohmann/json.hpp"

namespace o2v {

/// |ours - theirs| / max(1, |theirs|), for all numbers but the parameters after the updates.
inline constexpr double kOracleBound = 1e-9;
/// |ours - theirs| of the parameters after the updates.
inline constexpr double kOracleParamBound = 1e-10;

/// The worst of the numbers compared so far.
class Comparison {
 public:
  void Number(const std::string& where, double ours, double theirs);
  /// `theirs`: an array of the file, of the shape of `ours`. Throws Error when shapes differ.
  void Array(const std::string& where, const MatD& ours, const nlohmann::json& theirs);
  /// The same for parameters after updates.
  void UpdatedParam(const std::string& where, const MatD& ours, const nlohmann::json& theirs);

  std::size_t count() const { return count_; }
  /// Deviation, bound and place of the number that comes closest to its bound or exceeds it most.
  double deviation() const { return deviation_; }
  double bound() const { return bound_; }
  const std::string& where() const { return where_; }
  bool Passed() const { return count_ > 0 && deviation_ <= bound_; }

 private:
  void Add(double deviation, double bound, const std::string& where);

  std::size_t count_ = 0;
  double deviation_ = 0, bound_ = kOracleBound;
  std::string where_;
};

/// What a method adds to the comparison that all share.
struct OracleMethod {
  std::string id;
  /// Hyper-parameters and switches that not all methods have.
  void (*settings)(const nlohmann::json& file, Settings& hyper, Switches& switches);
  /// What the batch holds beside states, actions, advantages and targets.
  void (*batch)(const nlohmann::json& file, Batch& batch);
  /// Random choices in the loss of update `u` of a stage.
  FixedDraws (*draws)(const nlohmann::json& file, const std::string& stage, std::size_t u);
  /// Network outputs, and what follows from them, against `forward`.
  void (*forward)(const nlohmann::json& file, Algorithm& algorithm, const Batch& batch,
                  Comparison& out);
};

OracleMethod PpoOracle();
OracleMethod Option2VecOracle();
/// DAC-OneStep, DAC+PPO, AHP+PPO, IOPG, PPOC, OC.
std::vector<OracleMethod> OptionMethodOracles();

/// An array of a file as (rows, cols). Throws Error unless it holds rows * cols numbers.
MatD OracleArray(const nlohmann::json& array);
/// An array as n whole numbers in [0, below). Throws Error.
std::vector<int> OracleInts(const nlohmann::json& array, Index n, int below);
/// The same for flags.
std::vector<char> OracleFlags(const nlohmann::json& array, Index n);

/// The method of a file, by its `method`. Throws Error unless the file is one of this format.
std::string OracleFileMethod(const nlohmann::json& file);
/// Reads a file. Throws Error.
nlohmann::json ReadOracle(const std::filesystem::path& path);
/// Compares everything in a file of an existing method. Throws Error when the file is incomplete.
Comparison CompareOracle(const nlohmann::json& file);

}  // namespace o2v
