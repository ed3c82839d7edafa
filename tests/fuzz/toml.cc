// Config files as experiment, as a layer of a run, and as the config.toml of a run.

#include "fuzz/target.h"
#include "run/config.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace o2v;
  const ConfigText file{"x.toml", std::string(Bytes(data, size))};
  Accepts([&] { ReadExperiments(file); });
  Accepts([&] {
    RunRequest request;
    request.task = "Hopper-v2";
    request.algorithm = "ppo";
    request.config = file;
    ResolveRun(request);
  });
  RunConfig config;
  if (Accepts([&] { config = ParseRunConfig(file.text, file.name); })) {
    const std::string text = ToToml(config);
    Expect(ToToml(ParseRunConfig(text, "again.toml")) == text);
  }
  return 0;
}
