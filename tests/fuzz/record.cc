// The JSON half of a run's record, and the configuration in it.

#include "run/record.h"
#include "fuzz/target.h"
#include "run/config.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace o2v;
  static MemoryFile file;
  Accepts([&] {
    const RecordHead head = ReadRecordHead(file.Holding(Bytes(data, size)));
    ParseRunConfig(head.config_text, "record");
  });
  return 0;
}
