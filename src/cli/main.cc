// The program: its commands, exit codes. 0 success, 1 Error, 2 ConfigError or wrong usage, 3
// DivergedError.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <sstream>

#include "base/check.h"
#include "base/files.h"
#include "base/printable.h"
#include "cli/commands.h"
#include "nn/isa.h"
#include "run/manifest.h"

namespace o2v {
namespace {

int Main(int argc, char** argv) {
  CLI::App app("Option2Vec and seven rivals on MuJoCo tasks: a reference reproduction.",
               "option2vec");
  app.require_subcommand(1);
  app.footer("`option2vec SUBCOMMAND --help` shows options and examples.");
  app.set_version_flag("--version", VersionText,
                       "commit, compiler, flags, versions, products, libmujoco");
  int exit_code = 0;
  AddList(app);
  AddTrain(app);
  AddEval(app);
  AddForward(app);
  AddInterpret(app);
  AddExport(app);
  AddFilm(app);
  AddParams(app);
  AddReplay(app, exit_code);
  AddRecord(app);
  AddJobs(app, argv[0]);
  AddProgress(app);
  AddSummary(app);
  const auto fail = [](const std::exception& e, int code) {
    std::cerr << "option2vec: " << Printable(e.what()) << "\n";
    return code;
  };
  // What a command prints is written in one go when it ends, so that a loss is seen.
  std::ostringstream text;
  std::streambuf* const own = std::cout.rdbuf(text.rdbuf());
  try {
    ChosenIsa();  // throws when O2V_ISA is wrong
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {  // --help
    exit_code = app.exit(e);
  } catch (const CLI::ParseError& e) {
    exit_code = fail(e, 2);
  } catch (const ConfigError& e) {
    exit_code = fail(e, 2);
  } catch (const DivergedError& e) {
    exit_code = fail(e, 3);
  } catch (const std::exception& e) {
    exit_code = fail(e, 1);
  }
  std::cout.rdbuf(own);
  try {
    WriteAll(STDOUT_FILENO, "standard output", text.str());
  } catch (const Error& e) {
    exit_code = fail(e, exit_code == 0 ? 1 : exit_code);
  }
  return exit_code;
}

}  // namespace
}  // namespace o2v

int main(int argc, char** argv) {
  o2v::OpenStandardStreams();
  return o2v::Main(argc, argv);
}
