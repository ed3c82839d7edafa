#pragma once
// Checkpoints in the safetensors layout: u64 little-endian length of the header, a JSON header
// {name: {dtype, shape, data_offsets}}, then the data.
//
//   <parameter>       F32, named and shaped as Learner::Params(), row-major, vectors (n, 1)
//   normalizer.mean   F64 (S, 1);  normalizer.var F64 (S, 1);  normalizer.count F64 (1, 1)
//   training.<name>   all else that a resumed run needs: F32 matrices, F64 and I64 (n, 1)
//   __metadata__      strings; "format" tells our files from others; "checksum" covers the metadata
//                     and every tensor's name, type, shape and data
//
// A file is checked whole before anything is changed. Every failure is an Error that names the file
// and what is wrong with it.

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "algo/algorithm.h"
#include "base/state.h"
#include "rollout/normalizer.h"

namespace o2v {

using Metadata = std::map<std::string, std::string>;
/// Shows all state of a run to a visitor, the algorithm's included.
using StateWalk = std::function<void(StateVisitor&)>;

/// Writes a checkpoint with WriteFileAtomically. "format" and "checksum" are added to the metadata.
void SaveCheckpoint(const std::filesystem::path& path, Metadata metadata, Learner& learner,
                    const StateWalk& walk, const std::function<void()>& before_rename = {});

/// Writes a policy alone, as SaveCheckpoint writes it: parameters and normaliser.
void SavePolicy(const std::filesystem::path& path, const Metadata& metadata, Learner& learner,
                Normalizer& normalizer);

/// Restores all state of a run from a file of SaveCheckpoint, which must hold exactly the tensors
/// that `walk` shows, finite and within the bounds that the walk states. Returns the metadata that
/// SaveCheckpoint was given.
Metadata LoadCheckpoint(const std::filesystem::path& path, Learner& learner, const StateWalk& walk);

/// The metadata of a file; empty for one from elsewhere, whatever it says.
Metadata ReadMetadata(const std::filesystem::path& path);
/// Environment steps of the run that wrote it; nothing where the metadata does not say.
std::optional<std::int64_t> TotalSteps(const Metadata& metadata);

/// Sets parameters and normaliser only. Also takes files from elsewhere: any metadata, no training
/// state, no normalizer.count, F64 numbers. Every parameter must be there with its shape and finite
/// values; a name that is neither a parameter, nor of the normaliser, nor training state is
/// refused.
void LoadPolicy(const std::filesystem::path& path, Learner& learner, Normalizer& normalizer);

/// The newest checkpoint of a run: last.ckpt in its folder, or the file itself. Throws ConfigError
/// when there is none.
std::filesystem::path FindCheckpoint(const std::filesystem::path& run);

}  // namespace o2v
