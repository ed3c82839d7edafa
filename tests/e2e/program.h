#pragma once
// The program from outside, in a folder of the test's own.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <string>

#include "base/files.h"
#include "test_folder.h"

namespace o2v {

struct Outcome {
  int code;
  std::string out, err;
};

class Program : public testing::Test {
 protected:
  /// Runs `<environment> option2vec <arguments>` in the test's folder.
  Outcome Run(const std::string& arguments, const std::string& environment = "") const {
    const std::string command = "cd '" + dir_.path().string() + "' && " + environment + " '" +
                                O2V_PROGRAM + "' " + arguments + " > stdout 2> stderr < /dev/null";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ReadFile(dir_ / "stdout"),
            ReadFile(dir_ / "stderr")};
  }
  /// A run of two short rollouts.
  Outcome Train(const std::string& more) const {
    return Run("train --task InvertedPendulum-v2 --algo ppo --steps 128 --set rollout=64 " + more);
  }

  const TestFolder dir_;
};

}  // namespace o2v
