#include "run/checkpoint.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "fake_run.h"

namespace o2v {
namespace {

using nlohmann::json;

/// A run's state: two workers that have taken some steps.
struct State {
  explicit State(std::uint64_t seed, int rollouts = 3)
      : env([] { return std::make_unique<FakeEnv>(); }, 2, seed), algorithm(env.Spec(), seed) {
    env.Reset();
    std::vector<Episode> episodes;
    for (int i = 0; i < rollouts; ++i) {
      algorithm.Collect(env, episodes);
      algorithm.Update();
    }
  }
  StateWalk Walk() {
    return [this](StateVisitor& v) {
      algorithm.Serialize(v);
      env.Serialize(v);
    };
  }

  VecEnv env;
  FakeAlgorithm algorithm;
};

/// The JSON header and the data of a file in the safetensors layout.
std::pair<json, std::string> Split(const std::string& text) {
  std::uint64_t length = 0;
  std::memcpy(&length, text.data(), sizeof length);
  return {json::parse(text.substr(8, length)), text.substr(8 + length)};
}

std::string Join(const json& header, const std::string& data) {
  const std::string text = header.dump();
  std::uint64_t length = text.size();
  return std::string(reinterpret_cast<const char*>(&length), 8) + text + data;
}

template <typename Number>
void Add(json& header, std::string& data, const std::string& name, const char* type,
         std::vector<Index> shape, const std::vector<Number>& values) {
  const std::size_t begin = data.size(), size = values.size() * sizeof(Number);
  data.append(reinterpret_cast<const char*>(values.data()), size);
  header[name] = {{"dtype", type}, {"shape", shape}, {"data_offsets", {begin, begin + size}}};
}

class Checkpoint : public testing::Test {
 protected:
  void Write(const std::string& text) { WriteFileAtomically(path_, text); }
  void Save(State& state) {
    SaveCheckpoint(path_, {{"method", "fake"}}, state.algorithm, state.Walk());
  }
  std::string RefusedPolicy() {
    State state(9);
    const Mat before = state.algorithm.Params()[0]->value;
    Normalizer normalizer(2);
    try {
      LoadPolicy(path_, state.algorithm, normalizer);
    } catch (const Error& e) {
      EXPECT_EQ(state.algorithm.Params()[0]->value, before);
      EXPECT_EQ(normalizer.mean(), VecD::Zero(2));
      const std::string message = e.what(), file = path_.string() + ": ";
      EXPECT_TRUE(message.starts_with(file)) << message;
      return message.substr(std::min(message.size(), file.size()));
    }
    return "accepted";
  }
  /// Parameters and statistics, as another program might write them.
  std::pair<json, std::string> Foreign() const {
    json header;
    std::string data;
    Add<double>(header, data, "actor.W", "F64", {1, 2}, {0.5, -0.25});
    Add<float>(header, data, "actor.b", "F32", {1, 1}, {2});
    Add<double>(header, data, "normalizer.mean", "F64", {2, 1}, {1, 2});
    Add<double>(header, data, "normalizer.var", "F64", {2, 1}, {4, 9});
    return {header, data};
  }

  TestFolder dir_;
  const std::filesystem::path path_ = dir_ / "x.ckpt";
};

TEST_F(Checkpoint, RestoresEveryByteOfTheState) {
  State saved(1), loaded(2, 5);
  Save(saved);
  const std::string text = ReadFile(path_);
  const Metadata metadata = LoadCheckpoint(path_, loaded.algorithm, loaded.Walk());
  EXPECT_EQ(metadata, (Metadata{{"method", "fake"}}));
  Save(loaded);
  EXPECT_TRUE(ReadFile(path_) == text);
}

TEST_F(Checkpoint, HasTheSafetensorsLayout) {
  State state(1);
  state.algorithm.Params()[0]->value << 1, 2;
  Save(state);
  const auto [header, data] = Split(ReadFile(path_));
  EXPECT_EQ(header["actor.W"]["dtype"], "F32");
  EXPECT_EQ(header["actor.W"]["shape"], json({1, 2}));
  EXPECT_EQ(header["actor.b"]["shape"], json({1, 1}));
  EXPECT_EQ(header["normalizer.mean"]["dtype"], "F64");
  EXPECT_EQ(header["normalizer.mean"]["shape"], json({2, 1}));
  EXPECT_EQ(header["normalizer.count"]["shape"], json({1, 1}));
  EXPECT_EQ(header["training.worker0.rng"]["dtype"], "I64");
  float W[2];
  std::memcpy(W, data.data() + header["actor.W"]["data_offsets"][0].get<std::size_t>(), sizeof W);
  EXPECT_EQ(W[0], 1);
  EXPECT_EQ(W[1], 2);
}

TEST_F(Checkpoint, WritesMatricesRowByRow) {
  State state(1);
  Mat x(2, 3);
  x << 1, 2, 3, 4, 5, 6;
  SaveCheckpoint(path_, {}, state.algorithm, [&](StateVisitor& v) {
    state.algorithm.Serialize(v);
    v.Matrix("x", x);
  });
  const auto [header, data] = Split(ReadFile(path_));
  float rows[6];
  std::memcpy(rows, data.data() + header["training.x"]["data_offsets"][0].get<std::size_t>(),
              sizeof rows);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(rows[i], i + 1);
}

TEST_F(Checkpoint, DoesNotTakeTwoArraysOfOneName) {
  State state(1);
  EXPECT_THROW(SaveCheckpoint(path_, {}, state.algorithm,
                              [&](StateVisitor& v) {
                                state.algorithm.Serialize(v);
                                state.algorithm.Serialize(v);
                              }),
               Error);
}

TEST_F(Checkpoint, DoesNotForgetAParameter) {
  State state(1);
  EXPECT_THROW(SaveCheckpoint(path_, {}, state.algorithm, [](StateVisitor&) {}), Error);
}

TEST_F(Checkpoint, OfAnotherRunShapeIsRefusedWithoutATrace) {
  State saved(1), loaded(2);
  Save(saved);
  const Mat before = loaded.algorithm.Params()[0]->value;
  double more[3] = {};
  for (const bool extra :
       {true, false}) {  // the run has one array more, or all of the environment less
    EXPECT_THROW(LoadCheckpoint(path_, loaded.algorithm,
                                [&](StateVisitor& v) {
                                  loaded.algorithm.Serialize(v);
                                  if (extra) loaded.env.Serialize(v), v.Doubles("more", more, 3);
                                }),
                 Error);
    EXPECT_EQ(loaded.algorithm.Params()[0]->value, before);
  }
}

TEST_F(Checkpoint, WithoutAChecksumCannotBeResumed) {
  State saved(1);
  Save(saved);
  auto [header, data] = Split(ReadFile(path_));
  header["__metadata__"].erase("checksum");
  Write(Join(header, data));
  EXPECT_THROW(LoadCheckpoint(path_, saved.algorithm, saved.Walk()), Error);
}

TEST_F(Checkpoint, ChecksumCoversMetadataToo) {
  State saved(1);
  Save(saved);
  auto [header, data] = Split(ReadFile(path_));
  header["__metadata__"]["method"] = "other";
  Write(Join(header, data));
  EXPECT_THROW(ReadMetadata(path_), Error);
  const Metadata all = {
      {"task", "a"}, {"method", "b"}, {"config", "c"}, {"switches", "d"}, {"total_steps", "5"}};
  SaveCheckpoint(path_, all, saved.algorithm, saved.Walk());
  const auto [good, bytes] = Split(ReadFile(path_));
  for (const auto& [key, value] : all) {
    header = good;
    header["__metadata__"][key] = value + "0";
    Write(Join(header, bytes));
    EXPECT_THROW(ReadMetadata(path_), Error) << key;
  }
  Write(Join(good, bytes));
  EXPECT_EQ(ReadMetadata(path_).at("config"), "c");
}

/// A state with options and a counter.
struct Indexed {
  State state{1};
  std::vector<int> o_prev = {2, 0};
  std::int64_t steps = 5;
  StateWalk Walk() {
    return [this](StateVisitor& v) {
      state.Walk()(v);
      v.AllBelow("options", o_prev, 3);
      v.Count("counter", steps);
    };
  }
};

TEST_F(Checkpoint, RefusesIndicesAndCountersOutOfRangeWithoutATrace) {
  const auto refused = [&](std::vector<int> o_prev, std::int64_t steps) -> std::string {
    Indexed saved, loaded;
    saved.o_prev = std::move(o_prev);
    saved.steps = steps;
    SaveCheckpoint(path_, {}, saved.state.algorithm, [&](StateVisitor& v) {
      saved.state.Walk()(v);
      v.Ints("options", saved.o_prev);
      v.Int("counter", saved.steps);
    });
    loaded.state.algorithm.Params()[0]->value.setConstant(77);
    try {
      LoadCheckpoint(path_, loaded.state.algorithm, loaded.Walk());
    } catch (const Error& e) {
      EXPECT_EQ(loaded.state.algorithm.Params()[0]->value(0, 0), 77);
      return std::string(e.what()).substr(path_.string().size() + 2);
    }
    return "";
  };
  EXPECT_EQ(refused({2, 0}, 5), "");
  EXPECT_EQ(refused({2, 3}, 5), "training.options: 3 is not in [0, 2]");
  EXPECT_EQ(refused({2, 100000000}, 5), "training.options: 100000000 is not in [0, 2]");
  EXPECT_EQ(refused({2, 0}, -1), "training.counter: -1 is not in [0, 9007199254740992]");
}

TEST_F(Checkpoint, RefusesWholeNumbersThatDoNotFitAnInt) {
  Indexed saved;
  std::int64_t wide[2] = {std::int64_t{1} << 32, 0};
  SaveCheckpoint(path_, {}, saved.state.algorithm, [&](StateVisitor& v) {
    saved.state.Walk()(v);
    v.Ints("options", wide, 2);
    v.Int("counter", saved.steps);
  });
  EXPECT_THROW(LoadCheckpoint(path_, saved.state.algorithm,
                              [&](StateVisitor& v) {
                                saved.state.Walk()(v);
                                v.Ints("options", saved.o_prev);
                                v.Int("counter", saved.steps);
                              }),
               Error);
}

TEST_F(Checkpoint, WithANumberThatIsNotFiniteCannotBeResumed) {
  State saved(1), loaded(1);
  double x[2] = {1, std::numeric_limits<double>::infinity()};
  const auto walk = [&](State& state) -> StateWalk {
    return [&](StateVisitor& v) {
      state.Walk()(v);
      v.Doubles("more", x, 2);
    };
  };
  SaveCheckpoint(path_, {}, saved.algorithm, walk(saved));
  EXPECT_THROW(LoadCheckpoint(path_, loaded.algorithm, walk(loaded)), Error);
  x[1] = 2;
  saved.algorithm.Params()[0]->value(0, 0) = std::numeric_limits<Real>::quiet_NaN();
  SaveCheckpoint(path_, {}, saved.algorithm, walk(saved));
  EXPECT_THROW(LoadCheckpoint(path_, loaded.algorithm, walk(loaded)), Error);
}

TEST_F(Checkpoint, WithANameThatStandsTwiceIsRefused) {
  const auto [header, data] = Foreign();
  std::string text = header.dump();
  text.insert(1, R"("actor.b": {"dtype": "F32", "shape": [1, 1], "data_offsets": [0, 4]},)");
  text.append((8 - text.size() % 8) % 8, ' ');
  const std::uint64_t length = text.size();
  Write(std::string(reinterpret_cast<const char*>(&length), 8) + text + data);
  EXPECT_EQ(RefusedPolicy(), "bad header: actor.b appears twice");
}

TEST_F(Checkpoint, FromElsewhereMayHaveMetadataOfItsOwn) {
  auto [header, data] = Foreign();
  header["__metadata__"] = {{"format", "pt"}, {"checksum", "sha256:1"}, {"config", "{}"}};
  Write(Join(header, data));
  State state(2);
  Normalizer normalizer(2);
  LoadPolicy(path_, state.algorithm, normalizer);
  EXPECT_EQ(state.algorithm.Params()[0]->value(0, 1), Real(-0.25));
  EXPECT_TRUE(ReadMetadata(path_).empty());
}

TEST_F(Checkpoint, OfANewerFormatIsRefused) {
  auto [header, data] = Foreign();
  header["__metadata__"] = {{"format", "option2vec-2"}};
  Write(Join(header, data));
  EXPECT_EQ(RefusedPolicy(), "format option2vec-2; this program reads option2vec-1");
}

TEST_F(Checkpoint, OfARunGivesItsPolicy) {
  State saved(1), loaded(2);
  Save(saved);
  Normalizer normalizer(2);
  LoadPolicy(path_, loaded.algorithm, normalizer);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(loaded.algorithm.Params()[i]->value, saved.algorithm.Params()[i]->value);
  }
  EXPECT_EQ(normalizer.mean(), saved.env.normalizer().mean());
  EXPECT_EQ(normalizer.var(), saved.env.normalizer().var());
  EXPECT_EQ(normalizer.count(), saved.env.normalizer().count());
}

TEST_F(Checkpoint, OfAPolicyAloneHoldsParametersAndNormaliserAlone) {
  State saved(1), loaded(2);
  Normalizer statistics(2), normalizer(2);
  statistics.Set(VecD::Constant(2, 0.1), VecD::Constant(2, 3), 7);
  SavePolicy(path_, {{"config", "x"}}, saved.algorithm, statistics);
  std::vector<std::string> names;
  const json header = Split(ReadFile(path_)).first;
  for (const auto& [name, entry] : header.items()) names.push_back(name);
  EXPECT_EQ(names,
            (std::vector<std::string>{"__metadata__", "actor.W", "actor.b", "normalizer.count",
                                      "normalizer.mean", "normalizer.var"}));
  EXPECT_EQ(ReadMetadata(path_).at("config"), "x");
  LoadPolicy(path_, loaded.algorithm, normalizer);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(loaded.algorithm.Params()[i]->value, saved.algorithm.Params()[i]->value);
  }
  EXPECT_EQ(normalizer.mean(), statistics.mean());
  EXPECT_EQ(normalizer.var(), statistics.var());
  EXPECT_EQ(normalizer.count(), 7);
}

TEST_F(Checkpoint, FromElsewhereGivesItsPolicy) {
  const auto [header, data] = Foreign();
  Write(Join(header, data));
  State state(2);
  Normalizer normalizer(2);
  LoadPolicy(path_, state.algorithm, normalizer);
  EXPECT_EQ(state.algorithm.Params()[0]->value(0, 1), Real(-0.25));
  EXPECT_EQ(state.algorithm.Params()[1]->value(0, 0), Real(2));
  EXPECT_EQ(normalizer.mean(), VecD({{1, 2}}));
  EXPECT_EQ(normalizer.var(), VecD({{4, 9}}));
  EXPECT_TRUE(ReadMetadata(path_).empty());
}

TEST_F(Checkpoint, WithAnUnknownNameIsRefused) {
  auto [header, data] = Foreign();
  Add<float>(header, data, "actor.c", "F32", {1, 1}, {2});
  Write(Join(header, data));
  EXPECT_EQ(RefusedPolicy(), "actor.c is not a parameter of the method");
}

TEST_F(Checkpoint, WithoutAParameterIsRefused) {
  auto [header, data] = Foreign();
  header["normalizer.count"] = header["actor.b"];
  header.erase("actor.b");
  Write(Join(header, data));
  EXPECT_EQ(RefusedPolicy(), "actor.b is missing");
}

TEST_F(Checkpoint, WithATransposedParameterIsRefused) {
  auto [header, data] = Foreign();
  header["actor.W"]["shape"] = {2, 1};
  Write(Join(header, data));
  EXPECT_EQ(RefusedPolicy(), "actor.W is F64 (2, 1), not F32 or F64 (1, 2)");
}

TEST_F(Checkpoint, WithANonFiniteParameterIsRefused) {
  auto [header, data] = Foreign();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::memcpy(data.data(), &nan, sizeof nan);
  Write(Join(header, data));
  EXPECT_EQ(RefusedPolicy(), "actor.W has a value that is not finite");
}

TEST_F(Checkpoint, WithANegativeVarianceIsRefused) {
  auto [header, data] = Foreign();
  const double var = -1;
  std::memcpy(data.data() + data.size() - sizeof var, &var, sizeof var);
  Write(Join(header, data));
  EXPECT_EQ(RefusedPolicy(), "normalizer.var has a negative entry");
}

TEST_F(Checkpoint, WithABadHeaderIsRefused) {
  const auto [good, data] = Foreign();
  const auto refused = [&, data = data](const char* key, const json& value) {
    json header = good;
    header["actor.b"][key] = value;
    Write(Join(header, data));
    return RefusedPolicy();
  };
  EXPECT_EQ(refused("dtype", "F16"), "actor.b: type F16 is not F32, F64 or I64");
  EXPECT_EQ(refused("shape", {1}), "actor.b: 'shape' is not a pair of whole numbers");
  EXPECT_EQ(refused("shape", {-1, -1}), "actor.b: 'shape' is not a pair of whole numbers");
  EXPECT_EQ(refused("shape", {2, 1}), "actor.b: 4 bytes are not F32 (2, 1)");
  EXPECT_EQ(refused("shape", {std::uint64_t{1} << 63, 2}),
            "actor.b: 4 bytes are not F32 (9223372036854775808, 2)");
  EXPECT_EQ(refused("data_offsets", {16, 2000}),
            "actor.b: data [16, 2000) is not inside the 52 bytes of data");
  EXPECT_EQ(refused("data_offsets", {20, 16}),
            "actor.b: data [20, 16) is not inside the 52 bytes of data");
  EXPECT_EQ(refused("data_offsets", {12, 16}),
            "tensors overlap or leave a gap at byte 12 of the data");
  EXPECT_EQ(refused("extra", 1), "actor.b: the header entry is not {dtype, shape, data_offsets}");
}

TEST_F(Checkpoint, WithBytesLeftOverIsRefused) {
  const auto [header, data] = Foreign();
  Write(Join(header, data + "more"));
  EXPECT_EQ(RefusedPolicy(), "4 bytes of data belong to no tensor");
}

TEST_F(Checkpoint, ThatIsSomethingElseIsRefused) {
  Write("");
  EXPECT_EQ(RefusedPolicy(), "not a checkpoint: 0 bytes");
  Write("step,worker,return\n1,2,3\n");
  EXPECT_TRUE(RefusedPolicy().starts_with("not a whole checkpoint: a header of"));
  Write(Join(json::array(), ""));
  EXPECT_EQ(RefusedPolicy(), "the header is not a JSON object");
  Write(std::string("\1\0\0\0\0\0\0\0{", 9));
  EXPECT_TRUE(RefusedPolicy().starts_with("not a checkpoint: bad header"));
}

TEST(FindCheckpoint, TakesTheFolderOfARunOrTheFileItself) {
  TestFolder dir;
  const auto message = [&]() -> std::string {
    try {
      FindCheckpoint(dir / "run");
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(message(), (dir / "run").string() + ": no such folder or checkpoint");
  std::filesystem::create_directory(dir / "run");
  EXPECT_EQ(message(), (dir / "run").string() + ": no last.ckpt in this folder");
  WriteFileAtomically(dir / "run" / "last.ckpt", "x");
  EXPECT_EQ(FindCheckpoint(dir / "run"), dir / "run" / "last.ckpt");
  EXPECT_EQ(FindCheckpoint(dir / "run" / "last.ckpt"), dir / "run" / "last.ckpt");
}

}  // namespace
}  // namespace o2v
