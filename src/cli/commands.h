#pragma once
// The commands: each adds itself to the program, with its options, help and what it does.

#include <CLI/CLI.hpp>
#include <string>

namespace o2v {

void AddList(CLI::App& app);
void AddTrain(CLI::App& app);
void AddEval(CLI::App& app);
void AddForward(CLI::App& app);
void AddInterpret(CLI::App& app);
void AddExport(CLI::App& app);
void AddFilm(CLI::App& app);
void AddParams(CLI::App& app);
/// exit_code: 1 where the trajectories differ.
void AddReplay(CLI::App& app, int& exit_code);
void AddRecord(CLI::App& app);
/// program: as it was called, the first word of the commands that it prints.
void AddJobs(CLI::App& app, const std::string& program);
void AddProgress(CLI::App& app);
void AddSummary(CLI::App& app);

}  // namespace o2v
