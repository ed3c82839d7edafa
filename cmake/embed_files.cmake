# Script of o2v_embed: writes ${DIR}/embedded/${NAME}.h and ${DIR}/${NAME}.cc from FILES.
file(WRITE ${DIR}/embedded/${NAME}.h "#pragma once
#include <span>
#include <string_view>
namespace o2v {
struct EmbeddedFile_${NAME} {
  std::string_view name, text;
};
/// The files compiled into the program, sorted by name.
std::span<const EmbeddedFile_${NAME}> Embedded_${NAME}();
}  // namespace o2v
")
set(arrays "")
set(table "")
set(i 0)
list(SORT FILES)
foreach(file IN LISTS FILES)
  file(RELATIVE_PATH path ${ROOT} ${file})
  file(READ ${file} hex HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
  string(APPEND arrays "constexpr unsigned char kFile${i}[] = {${bytes}0};\n")
  string(APPEND table
         "    {\"${path}\", {reinterpret_cast<const char*>(kFile${i}), sizeof(kFile${i}) - 1}},\n")
  math(EXPR i "${i} + 1")
endforeach()
file(WRITE ${DIR}/${NAME}.cc "#include \"embedded/${NAME}.h\"
namespace o2v {
namespace {
${arrays}
const EmbeddedFile_${NAME} kFiles[] = {
${table}};
}  // namespace
std::span<const EmbeddedFile_${NAME}> Embedded_${NAME}() { return kFiles; }
}  // namespace o2v
")
