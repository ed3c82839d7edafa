#include "run/config.h"

#include <toml++/toml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <type_traits>
#include <variant>

#include "base/decimal.h"
#include "base/files.h"
#include "base/names.h"
#include "embedded/configs.h"
#include "env/pairs.h"

namespace o2v {
namespace {

/// A number or word as written, and where ("file:line").
struct Scalar {
  std::variant<std::int64_t, double, std::string> value;
  std::string origin;
};
using Table = std::map<std::string, Scalar, std::less<>>;

/// A config file, or several on top of each other, as seen by one run.
struct Layer {
  Table run;       // [run]
  Table switches;  // [switches]
  Table hyper;     // [algo.<method>]; also `workers`, which depends on the method
  int format = 1;  // of the file, see AddedKey
};

/// What conditional tables are asked about.
struct Scope {
  std::string fidelity, algorithm;
  std::string tasks;     // registry ids, joined by commas
  std::string task;      // the id, or the name of the pair
  std::string suite;     // gym | dm
  std::string transfer;  // "transfer" in a run over several tasks, else empty
};

// Numbers of [run] that --set takes; the others have their own options.
const std::vector<std::string> kRunNumbers = {"steps", "checkpoint_every", "eval_every",
                                              "eval_episodes"};
const std::vector<std::string> kRunWords = {"task", "algorithm", "fidelity"};
constexpr const char* kFormatKey = "format";
constexpr const char* kCommandLine = "command line";  // the origin of what no file gives
const std::vector<std::string> kFidelities = {"paper", "released"};
const std::vector<std::string> kSuites = {"gym", "dm", "transfer"};

// Numbers that are written as words: a word's place in the list is its number.
const std::map<std::string, std::vector<std::string>, std::less<>> kWords = {
    {"activation", {"tanh", "relu"}},
};

template <typename Range>
std::vector<std::string> Ids(const Range& registry) {
  std::vector<std::string> ids;
  for (const auto& entry : registry) ids.push_back(entry.id);
  return ids;
}

template <typename Value>
std::vector<std::string> Keys(const std::map<std::string, Value, std::less<>>& table) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : table) keys.push_back(key);
  return keys;
}

std::vector<std::string> PairNames() {
  std::vector<std::string> names;
  for (const TaskPair& pair : PairRegistry()) names.push_back(pair.name);
  return names;
}

std::vector<std::string> Union(std::initializer_list<std::vector<std::string>> lists) {
  std::vector<std::string> all;
  for (const auto& list : lists) all.insert(all.end(), list.begin(), list.end());
  return all;
}

bool Contains(const std::vector<std::string>& list, std::string_view x) {
  return std::find(list.begin(), list.end(), x) != list.end();
}

[[noreturn]] void Unknown(const std::string& origin, const char* what, std::string_view name,
                          const std::vector<std::string>& known) {
  throw ConfigError(
      Concat(origin, ": unknown ", what, " '", name, "'; nearest: ", Nearest(name, known)));
}

// ---- Files

toml::table Parse(const ConfigText& file) {
  try {
    return toml::parse(file.text);
  } catch (const toml::parse_error& e) {
    throw ConfigError(Concat(file.name, ":", e.source().begin.line, ": ", e.description()));
  }
}

/// A config file and what it says, parsed once.
struct Document {
  ConfigText file;
  toml::table root;

  explicit Document(ConfigText text) : file(std::move(text)), root(Parse(file)) {}
};

/// The file of this name that is compiled into the program.
const Document& Embedded(const std::string& name) {
  static std::map<std::string, Document> documents;
  const auto found = documents.find(name);
  return found != documents.end()
             ? found->second
             : documents.emplace(name, Document(OpenConfig(name))).first->second;
}

std::string Origin(const ConfigText& file, const toml::node& node) {
  return Concat(file.name, ":", node.source().begin.line);
}

/// The table under `key`, null when there is none.
const toml::table* Section(const ConfigText& file, const toml::table& parent,
                           std::string_view key) {
  const toml::node* node = parent.get(key);
  if (node && !node->is_table()) {
    throw ConfigError(Concat(Origin(file, *node), ": '", key, "' must be a table, [", key, "]"));
  }
  return node ? node->as_table() : nullptr;
}

Scalar ReadScalar(const ConfigText& file, std::string_view key, const toml::node& node) {
  const std::string origin = Origin(file, node);
  if (const auto* x = node.as_integer()) return {x->get(), origin};
  if (const auto* x = node.as_floating_point()) return {x->get(), origin};
  if (const auto* x = node.as_string()) return {x->get(), origin};
  throw ConfigError(Concat(origin, ": '", key, "' must be a number or a word"));
}

/// The section's plain keys, then those of the tables in it that hold for `scope`.
void Flatten(const ConfigText& file, const toml::table* section, const Scope& scope, Table& out) {
  if (!section) return;
  static const auto known =
      Union({kSuites, kFidelities, Ids(AlgorithmRegistry()), Ids(EnvRegistry()), PairNames()});
  for (const auto& [key, node] : *section) {
    if (!node.is_table()) {
      out[std::string(key.str())] = ReadScalar(file, key.str(), node);
    } else if (!Contains(known, key.str())) {
      Unknown(Origin(file, node), "suite, fidelity, method or task", key.str(), known);
    }
  }
  for (const std::string& name :
       {scope.suite, scope.transfer, scope.fidelity, scope.algorithm, scope.task}) {
    Flatten(file, Section(file, *section, name), scope, out);
  }
}

/// The format of configurations that has all keys of the table.
int LastFormat(const std::vector<AddedKey>& added) {
  int last = 1;
  for (const AddedKey& key : added) last = std::max(last, key.since);
  return last;
}

/// The format that the file says it has. Throws ConfigError for one of a newer program.
int ReadFormat(const ConfigText& file, const toml::table& root, int last) {
  const toml::node* node = root.get(kFormatKey);
  if (!node) return 1;
  const std::int64_t format = node->value_exact<std::int64_t>().value_or(0);
  if (format < 1 || format > last) {
    throw ConfigError(Concat(Origin(file, *node), ": configuration format ", format,
                             "; this program reads 1 to ", last));
  }
  return static_cast<int>(format);
}

/// What the file says to a run of this scope.
Layer ReadLayer(const Document& document, const Scope& scope,
                const std::vector<AddedKey>& added = AddedKeys()) {
  const auto& [file, root] = document;
  const std::vector<std::string> sections = {"run", "switches", "algo", "experiment", kFormatKey};
  for (const auto& [key, node] : root) {
    if (!Contains(sections, key.str())) {
      Unknown(Origin(file, node), "section", key.str(), sections);
    }
  }
  Layer layer;
  layer.format = ReadFormat(file, root, LastFormat(added));
  Flatten(file, Section(file, root, "run"), scope, layer.run);
  Flatten(file, Section(file, root, "switches"), scope, layer.switches);
  if (const toml::table* algo = Section(file, root, "algo")) {
    const auto methods = Ids(AlgorithmRegistry());
    for (const auto& [key, node] : *algo) {
      if (!Contains(methods, key.str())) Unknown(Origin(file, node), "method", key.str(), methods);
    }
    Flatten(file, Section(file, *algo, scope.algorithm), scope, layer.hyper);
  }
  return layer;
}

void Put(const Table& from, Table& onto) {
  for (const auto& [key, scalar] : from) onto[key] = scalar;
}

void Put(const Layer& from, Layer& onto) {
  Put(from.run, onto.run);
  Put(from.switches, onto.switches);
  Put(from.hyper, onto.hyper);
}

// ---- Values

/// The shortest decimal that reads back to the same double, as TOML.
std::string Number(double x) {
  char text[32];
  // Beyond 2^53 the plain form could be read as an integer that does not fit.
  const auto end = std::abs(x) < 0x1p53
                       ? std::to_chars(text, std::end(text), x)
                       : std::to_chars(text, std::end(text), x, std::chars_format::scientific);
  return {text, end.ptr};
}

std::string InQuotes(const std::string& word) { return Concat('"', word, '"'); }

std::string Text(const Scalar& scalar) {
  return std::visit(
      [](const auto& x) -> std::string {
        if constexpr (std::is_same_v<std::decay_t<decltype(x)>, double>) return Number(x);
        if constexpr (std::is_same_v<std::decay_t<decltype(x)>, std::int64_t>)
          return std::to_string(x);
        if constexpr (std::is_same_v<std::decay_t<decltype(x)>, std::string>) return x;
      },
      scalar.value);
}

[[noreturn]] void Mistyped(std::string_view key, const Scalar& scalar, const std::string& needed) {
  throw ConfigError(Concat(scalar.origin, ": '", key, "' is '", Text(scalar), "', not ", needed));
}

const Scalar& Need(const Table& table, const std::string& where, std::string_view key) {
  const auto it = table.find(key);
  if (it == table.end()) throw ConfigError(Concat(where, ": missing key '", key, "'"));
  return it->second;
}

double ToReal(std::string_view key, const Scalar& scalar) {
  if (const auto words = kWords.find(key); words != kWords.end()) {
    const auto& list = words->second;
    const auto word = std::find(list.begin(), list.end(), Text(scalar));
    if (word == list.end()) Mistyped(key, scalar, Nearest(Text(scalar), list));
    return static_cast<double>(word - list.begin());
  }
  if (const auto* x = std::get_if<std::int64_t>(&scalar.value)) return static_cast<double>(*x);
  const auto* x = std::get_if<double>(&scalar.value);
  if (!x || !std::isfinite(*x)) Mistyped(key, scalar, "a finite number");
  return *x;
}

std::int64_t ToInt(std::string_view key, const Scalar& scalar, std::int64_t low,
                   std::int64_t high = std::numeric_limits<std::int64_t>::max()) {
  std::optional<std::int64_t> x;
  if (const auto* whole = std::get_if<std::int64_t>(&scalar.value)) x = *whole;
  if (const auto* real = std::get_if<double>(&scalar.value)) x = Whole(*real);  // 1e3
  if (!x || *x < low || *x > high) {
    Mistyped(key, scalar, Concat("a whole number in [", low, ", ", high, "]"));
  }
  return *x;
}

std::string ToWord(std::string_view key, const Scalar& scalar) {
  const auto* x = std::get_if<std::string>(&scalar.value);
  if (!x) Mistyped(key, scalar, "a word in quotes");
  return *x;
}

// ---- Runs

bool Concerns(const SwitchInfo& info, const std::string& algorithm, bool transfer) {
  return info.Concerns(algorithm) && (!info.transfer || transfer);
}

/// The switches that a run reads.
std::vector<std::string> SwitchNames(const Scope& scope) {
  std::vector<std::string> names;
  for (const SwitchInfo& info : SwitchRegistry()) {
    if (Concerns(info, scope.algorithm, !scope.transfer.empty())) names.push_back(info.name);
  }
  return names;
}

/// The method's own file, whose keys are the known ones.
Layer MethodLayer(const Scope& scope) {
  return ReadLayer(Embedded("algo/" + scope.algorithm), scope);
}

void RequireKnown(const Table& table, const std::vector<std::string>& known) {
  for (const auto& [key, scalar] : table) {
    if (!Contains(known, key)) Unknown(scalar.origin, "key", key, known);
  }
}

/// Checks and converts. `where` names the whole in messages about what is missing.
RunConfig Build(const Layer& layer, const Scope& scope, const Table& known_hyper,
                const std::string& where) {
  constexpr int kMaxInt = std::numeric_limits<int>::max();
  RequireKnown(layer.run, Union({kRunWords, kRunNumbers, {"seed"}}));
  RequireKnown(layer.hyper, Keys(known_hyper));
  auto need = [&](const char* key) { return Need(layer.run, where, key); };

  RunConfig config;
  config.task = scope.tasks;
  config.algorithm = scope.algorithm;
  // A conditional table may not override the names that it depends on.
  for (const auto& [key, name] : {std::pair{"task", scope.tasks},
                                  {"algorithm", scope.algorithm},
                                  {"fidelity", scope.fidelity}}) {
    const Scalar& scalar = need(key);
    const std::string word = ToWord(key, scalar);
    if ((key == std::string("task") ? JoinTasks(SplitTasks(word)) : word) != name) {
      throw ConfigError(Concat(scalar.origin, ": '", key, "' must be a plain key of [run]"));
    }
  }
  config.fidelity = ParseFidelity(scope.fidelity);
  config.seed = static_cast<std::uint64_t>(ToInt("seed", need("seed"), 0));
  config.steps = ToInt("steps", need("steps"), 1);
  config.checkpoint_every = ToInt("checkpoint_every", need("checkpoint_every"), 1);
  config.eval_every = ToInt("eval_every", need("eval_every"), 0);
  config.eval_episodes =
      static_cast<int>(ToInt("eval_episodes", need("eval_episodes"), 1, kMaxInt));

  config.switches = SwitchesFor(config.fidelity);
  const auto switches = SwitchNames(scope);
  for (const auto& [key, scalar] : layer.switches) {
    if (!Contains(switches, key)) Unknown(scalar.origin, "switch of this run", key, switches);
    try {
      SetSwitch(config.switches, config.algorithm, key, Text(scalar));
    } catch (const ConfigError& e) {
      throw ConfigError(Concat(scalar.origin, ": ", e.what()));
    }
  }
  for (const std::string& key : Keys(known_hyper)) {
    const Scalar& scalar = Need(layer.hyper, where, key);
    if (key == "workers") {
      config.workers = static_cast<int>(ToInt(key, scalar, 1, kMaxInt));
    } else {
      config.hyper.Set(key, ToReal(key, scalar), scalar.origin);
    }
  }
  return config;
}

/// Task, method and fidelity from [run]; unknown ids are refused here.
Scope CheckedScope(const Table& run, const std::string& where) {
  auto word = [&](const char* key, const char* what, const std::vector<std::string>& known) {
    const Scalar& scalar = Need(run, where, key);
    const std::string name = ToWord(key, scalar);
    if (!Contains(known, name)) Unknown(scalar.origin, what, name, known);
    return name;
  };
  Scope scope;
  scope.fidelity = word("fidelity", "fidelity", kFidelities);
  scope.algorithm = word("algorithm", "method", Ids(AlgorithmRegistry()));
  const Scalar& task = Need(run, where, "task");
  const std::vector<std::string> ids = SplitTasks(ToWord("task", task)), known = Ids(EnvRegistry());
  for (const std::string& id : ids) {
    if (!Contains(known, id)) Unknown(task.origin, "task", id, Union({known, PairNames()}));
  }
  scope.tasks = JoinTasks(ids);
  scope.task = TasksName(ids);
  scope.suite = ids[0].starts_with("dm-") ? "dm" : "gym";
  if (ids.size() > 1) scope.transfer = "transfer";
  return scope;
}

/// `text` of the command line: a whole number, a number, or else a word.
Scalar FromText(const std::string& text, std::string origin) {
  if (const auto whole = ReadDecimal<std::int64_t>(text)) return {*whole, std::move(origin)};
  if (const auto real = ReadReal(text)) return {*real, std::move(origin)};
  return {text, std::move(origin)};
}

/// Whether the file is a resolved configuration: such a one alone says all of [run].
bool IsResolved(const Table& run) {
  const auto keys = Union({kRunWords, kRunNumbers, {"seed"}});
  return std::all_of(keys.begin(), keys.end(), [&](const auto& key) { return run.contains(key); });
}

/// Completes a resolved configuration of an older format.
void AddHistory(const std::vector<AddedKey>& added, const Scope& scope, Layer& layer) {
  const auto switches = SwitchNames(scope);
  for (const AddedKey& key : added) {
    if (key.since <= layer.format) continue;
    const Scalar value =
        FromText(key.value, Concat("history of '", key.key, "', format ", key.since));
    if (key.section == "run") layer.run.emplace(key.key, value);
    if (key.section == "switches" && Contains(switches, key.key)) {
      layer.switches.emplace(key.key, value);
    }
    if (key.section == scope.algorithm) layer.hyper.emplace(key.key, value);
  }
}

void ApplySet(const std::string& assignment, const std::vector<std::string>& switches,
              const Table& known_hyper, Layer& layer) {
  const std::string origin = "--set " + assignment;
  const std::size_t eq = assignment.find('=');
  if (eq == std::string::npos) throw ConfigError(origin + ": expected key=value");
  const std::string key = assignment.substr(0, eq);
  const Scalar scalar = FromText(assignment.substr(eq + 1), origin);
  const auto hyper = Keys(known_hyper);
  if (Contains(switches, key)) {
    layer.switches[key] = scalar;
  } else if (Contains(hyper, key)) {
    layer.hyper[key] = scalar;
  } else if (Contains(kRunNumbers, key)) {
    layer.run[key] = scalar;
  } else {
    Unknown(origin, "key", key, Union({hyper, switches, kRunNumbers}));
  }
}

/// Keys that a setting of the experiment may have: switches and its methods' numbers.
std::vector<std::string> AblationKeys(const Experiment& experiment) {
  std::vector<std::string> keys;
  for (const SwitchInfo& info : SwitchRegistry()) keys.push_back(info.name);
  for (const std::string& algorithm : experiment.algorithms) {
    for (const std::string& fidelity : experiment.fidelities) {
      keys = Union({keys, Keys(MethodLayer({fidelity, algorithm, "", "", "", ""}).hyper)});
    }
  }
  return keys;
}

Experiment ReadExperiment(const ConfigText& file, const toml::table& section) {
  const std::vector<std::string> known = {"tasks", "algorithms", "fidelities", "seeds",
                                          "ablations"};
  for (const auto& [key, node] : section) {
    if (!Contains(known, key.str())) Unknown(Origin(file, node), "key", key.str(), known);
  }
  auto items = [&](const char* key, const toml::node* node) -> const toml::array& {
    if (!node) throw ConfigError(Concat(file.name, ": missing key '", key, "' in [experiment]"));
    const toml::array* list = node->as_array();
    if (!list || list->empty()) {
      throw ConfigError(Concat(Origin(file, *node), ": '", key, "' must be a non-empty list"));
    }
    return *list;
  };
  auto read = [&](const char* key, auto&& take) {
    for (const toml::node& item : items(key, section.get(key))) take(ReadScalar(file, key, item));
  };
  const auto tasks = Union({Ids(EnvRegistry()), PairNames()});
  auto read_words = [&](const char* key, std::vector<std::string>& out,
                        const std::vector<std::string>& ids) {
    read(key, [&](const Scalar& scalar) {
      out.push_back(ToWord(key, scalar));
      if (!Contains(ids, out.back())) Unknown(scalar.origin, "name", out.back(), ids);
    });
  };
  Experiment experiment;
  experiment.name = std::filesystem::path(file.name).stem();
  read_words("tasks", experiment.tasks, tasks);
  read_words("algorithms", experiment.algorithms, Ids(AlgorithmRegistry()));
  read_words("fidelities", experiment.fidelities, kFidelities);
  read("seeds", [&](const Scalar& scalar) {
    experiment.seeds.push_back(static_cast<std::uint64_t>(ToInt("seeds", scalar, 0)));
  });
  if (section.contains("ablations")) {
    std::vector<std::string> switches;
    for (const SwitchInfo& info : SwitchRegistry()) {
      if (!info.flag) switches.push_back(info.name);  // a flag is the same in both fidelities
    }
    const std::vector<std::string> keys = AblationKeys(experiment);
    auto change = [&](const toml::node& node) {
      const Scalar scalar = ReadScalar(file, "ablations", node);
      const std::string text = ToWord("ablations", scalar), key = text.substr(0, text.find('='));
      const auto& known_keys = key == text ? switches : keys;
      if (!Contains(known_keys, key)) Unknown(scalar.origin, "name", key, known_keys);
      experiment.ablations.back().push_back(text);
    };
    for (const toml::node& item : items("ablations", section.get("ablations"))) {
      experiment.ablations.emplace_back();
      if (!item.is_array()) {
        change(item);
      } else {
        for (const toml::node& part : items("ablations", &item)) change(part);
      }
    }
  }
  return experiment;
}

}  // namespace

const std::vector<AddedKey>& AddedKeys() {
  // {section, key, value that every run before had, first format that has the key}
  static const std::vector<AddedKey> added = {};
  return added;
}

bool Concerns(const SwitchInfo& info, const RunConfig& config) {
  return Concerns(info, config.algorithm, SplitTasks(config.task).size() > 1);
}

bool Takes(const RunConfig& config, const std::string& key) {
  const auto info = std::ranges::find(SwitchRegistry(), key, &SwitchInfo::name);
  if (info != SwitchRegistry().end()) return Concerns(*info, config);
  const auto numbers = config.hyper.Items();
  return key == "workers" || std::any_of(numbers.begin(), numbers.end(),
                                         [&](const auto& number) { return number.first == key; });
}

ConfigText OpenConfig(const std::string& config) {
  constexpr std::string_view kSuffix = ".toml";
  if (config.ends_with(kSuffix)) {
    try {
      return {config, ReadFile(config)};
    } catch (const Error& e) {
      throw ConfigError(e.what());
    }
  }
  std::vector<std::string> names;
  for (const auto& [name, text] : Embedded_configs()) {
    names.emplace_back(name.substr(0, name.size() - kSuffix.size()));
    if (names.back() == config) {
      return {Concat("paper_configs/", name), std::string(text)};
    }
  }
  Unknown("config", "name", config, names);
}

std::optional<ConfigText> FindSuite(const std::string& name) {
  for (const auto& [file, text] : Embedded_configs()) {
    if (file != name + ".toml") continue;
    ConfigText config{Concat("paper_configs/", file), std::string(text)};
    if (Parse(config).contains("experiment")) return config;
  }
  return std::nullopt;
}

RunConfig ResolveRun(const RunRequest& request, const std::vector<AddedKey>& added) {
  Table options;
  auto option = [&](const char* key, const char* name, const auto& value) {
    if (value) options[key] = {*value, name};
  };
  option("task", "--task", request.task);
  option("algorithm", "--algo", request.algorithm);
  option("fidelity", "--fidelity", request.fidelity);
  option("seed", "--seed", request.seed);
  option("steps", "--steps", request.steps);

  // First the plain keys of [run], by the empty scope: which task, method and fidelity? Only then
  // is it known which conditional tables hold.
  const Document& usual = Embedded("run");
  const auto given = request.config ? std::optional<Document>(*request.config) : std::nullopt;
  Table plain = ReadLayer(usual, {}).run;
  if (given) Put(ReadLayer(*given, {}, added).run, plain);
  Put(options, plain);
  const Scope scope = CheckedScope(plain, kCommandLine);

  const Layer method = MethodLayer(scope);
  Layer layer = ReadLayer(usual, scope);
  Put(method, layer);
  if (given) {
    Layer own = ReadLayer(*given, scope, added);
    if (IsResolved(own.run)) AddHistory(added, scope, own);
    Put(own, layer);
  }
  Put(options, layer.run);
  for (const std::string& assignment : request.set) {
    ApplySet(assignment, SwitchNames(scope), method.hyper, layer);
  }
  return Build(layer, scope, method.hyper, kCommandLine);
}

std::string ToToml(const RunConfig& config, const std::vector<AddedKey>& added) {
  const int format = LastFormat(added);
  std::string text = format == 1 ? "" : Concat(kFormatKey, " = ", format, "\n\n");
  text += Concat("[run]\ntask = \"", config.task, "\"\nalgorithm = \"", config.algorithm,
                 "\"\nfidelity = \"", ToString(config.fidelity), "\"\nseed = ", config.seed,
                 "\nsteps = ", config.steps, "\ncheckpoint_every = ", config.checkpoint_every,
                 "\neval_every = ", config.eval_every, "\neval_episodes = ", config.eval_episodes,
                 "\n\n[switches]\n");
  for (const SwitchInfo& info : SwitchRegistry()) {
    if (!Concerns(info, config)) continue;
    text += Concat(info.name, " = ",
                   info.number ? Number(config.switches.*info.number)
                               : InQuotes(SwitchValue(config.switches, info)),
                   "\n");
  }
  text += Concat("\n[algo.", config.algorithm, "]\nworkers = ", config.workers, "\n");
  for (const auto& [key, value] : config.hyper.Items()) {
    const auto words = kWords.find(key);
    text += Concat(
        key, " = ",
        words == kWords.end() ? Number(value) : InQuotes(words->second.at(std::size_t(value))),
        "\n");
  }
  return text;
}

RunConfig ParseRunConfig(const std::string& text, const std::string& file_name,
                         const std::vector<AddedKey>& added) {
  const Document document({file_name, text});
  const Scope scope = CheckedScope(ReadLayer(document, {}, added).run, file_name);
  Layer layer = ReadLayer(document, scope, added);
  AddHistory(added, scope, layer);
  for (const std::string& name : SwitchNames(scope)) {
    Need(layer.switches, file_name, name);
  }
  return Build(layer, scope, MethodLayer(scope).hyper, file_name);
}

std::unique_ptr<Algorithm> MakeRunAlgorithm(const RunConfig& config, const EnvSpec& spec,
                                            bool draw_weights) {
  AlgorithmInput input;
  input.S = spec.S;
  input.A = spec.A;
  input.workers = config.workers;
  input.time_limit = spec.time_limit;
  input.hyper = &config.hyper;
  input.switches = config.switches;
  input.seed = config.seed;
  input.draw_weights = draw_weights;
  auto algorithm = MakeAlgorithm(config.algorithm, input);
  const auto unused = config.hyper.Unused();
  if (!unused.empty()) {
    throw ConfigError(Concat(config.hyper.Origin(unused[0]), ": key '", unused[0],
                             "' is not used by '", config.algorithm, "'"));
  }
  return algorithm;
}

std::vector<Experiment> ReadExperiments(const ConfigText& file) {
  const toml::table root = Parse(file);
  std::vector<Experiment> experiments;
  const toml::node* node = root.get("experiment");
  if (const toml::array* list = node ? node->as_array() : nullptr; list && !list->empty()) {
    for (const toml::node& item : *list) {
      if (!item.is_table()) throw ConfigError(Origin(file, item) + ": expected [[experiment]]");
      experiments.push_back(ReadExperiment(file, *item.as_table()));
    }
  } else {
    const toml::table* section = Section(file, root, "experiment");
    if (!section) throw ConfigError(file.name + ": missing section [experiment]");
    experiments.push_back(ReadExperiment(file, *section));
  }
  return experiments;
}

}  // namespace o2v
