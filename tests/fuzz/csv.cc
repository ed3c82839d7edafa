// ReadCsv: a table that is accepted is whole and is read back from its own text.

#include "base/csv.h"

#include <cmath>

#include "fuzz/target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace o2v;
  static MemoryFile file;
  for (const CsvGaps gaps : {CsvGaps{}, CsvGaps{.rows = true, .cells = true}}) {
    CsvTable table;
    if (!Accepts([&] { table = ReadCsv(file.Holding(Bytes(data, size)), gaps); })) continue;
    Expect(!table.columns.empty() && table.values.size() == table.Rows() * table.columns.size());
    if (gaps.cells) continue;
    for (const double x : table.values) Expect(std::isfinite(x));
    const CsvTable again = ReadCsv(file.Holding(CsvText(table)));
    Expect(again.columns == table.columns && again.values == table.values);
  }
  return 0;
}
