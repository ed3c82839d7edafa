#include "run/progress_line.h"

#include <algorithm>
#include <iomanip>
#include <sstream>

namespace o2v {

void ProgressLine::AddEpisode(double ret) {
  constexpr std::size_t kShown = 20;  // as the smoothing of the curves
  returns_.push_back(ret);
  if (returns_.size() > kShown) returns_.pop_front();
}

void ProgressLine::Show(std::int64_t step, double rate, double seconds, bool last) {
  constexpr double kPlainEvery = 10;  // [s] between two lines in a log file
  if (!terminal_ && !last && seconds < next_) return;
  next_ = seconds + kPlainEvery;
  double sum = 0;
  for (const double ret : returns_) sum += ret;
  const auto left = static_cast<std::int64_t>(
      static_cast<double>(std::max<std::int64_t>(steps_ - step, 0)) / rate);
  std::ostringstream line;
  line << std::fixed << std::setprecision(0) << "step " << step << "/" << steps_ << "  " << rate
       << " steps/s  return ";
  if (returns_.empty()) {
    line << "-";
  } else {
    line << std::setprecision(2) << sum / static_cast<double>(returns_.size());
  }
  line << "  left " << left / 60 << ":" << std::setw(2) << std::setfill('0') << left % 60;
  constexpr const char* kClearLine = "\x1b[K";
  out_ << (terminal_ ? "\r" : "") << line.str() << (terminal_ ? kClearLine : "")
       << (!terminal_ || last ? "\n" : "") << std::flush;
}

}  // namespace o2v
