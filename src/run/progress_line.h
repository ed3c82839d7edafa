#pragma once
// What a person sees of a run.

#include <cstdint>
#include <deque>
#include <ostream>

namespace o2v {

/// One line: steps made, steps a second, the return of the last episodes, the time left. On a
/// terminal it is overwritten, in a log file it appears every ten seconds.
class ProgressLine {
 public:
  ProgressLine(std::ostream& out, bool terminal, std::int64_t steps)
      : out_(out), terminal_(terminal), steps_(steps) {}

  void AddEpisode(double ret);
  /// `rate` in steps a second; `seconds` since the process started on the run.
  void Show(std::int64_t step, double rate, double seconds, bool last);

 private:
  std::ostream& out_;
  bool terminal_;
  std::int64_t steps_;
  std::deque<double> returns_;
  double next_ = 0;  // [s] when a log file gets its next line
};

}  // namespace o2v
