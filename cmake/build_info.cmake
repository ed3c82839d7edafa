# Script that every build runs: writes ${OUT} with commit, compiler and flags of the program. It leaves
# the file alone when nothing changed.
set(commit unknown)
execute_process(COMMAND git rev-parse HEAD WORKING_DIRECTORY ${SOURCE_DIR} OUTPUT_VARIABLE head
                OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE failed ERROR_QUIET)
if(NOT failed)
  set(commit ${head})
  execute_process(COMMAND git status --porcelain --untracked-files=no
                  WORKING_DIRECTORY ${SOURCE_DIR} OUTPUT_VARIABLE changes ERROR_QUIET)
  if(changes)
    string(APPEND commit -dirty)
  endif()
endif()
file(CONFIGURE OUTPUT ${OUT} @ONLY CONTENT [[
#pragma once
namespace o2v {
inline constexpr char kBuildCommit[] = "@commit@";
inline constexpr char kBuildCompiler[] = "@COMPILER@";
inline constexpr char kBuildFlags[] = "@FLAGS@";
}  // namespace o2v
]])
