# o2v_embed(<target> <name> <glob>...): compiles the matched text files into <target>. The header
# "embedded/<name>.h" declares   std::span<const EmbeddedFile_<name>> Embedded_<name>();
# A file's name is its path below the folder of the first glob ("gym_ant.xml", "algo/ppo.toml").
function(o2v_embed target name)
  set(dir ${CMAKE_BINARY_DIR}/embedded/${target})
  list(GET ARGN 0 first)
  get_filename_component(root ${first} DIRECTORY)
  file(GLOB files CONFIGURE_DEPENDS ${ARGN})
  add_custom_command(
    OUTPUT ${dir}/embedded/${name}.h ${dir}/${name}.cc
    COMMAND ${CMAKE_COMMAND} -DNAME=${name} -DDIR=${dir} -DROOT=${root} "-DFILES=${files}" -P
            ${CMAKE_SOURCE_DIR}/cmake/embed_files.cmake
    DEPENDS ${files} ${CMAKE_SOURCE_DIR}/cmake/embed_files.cmake
    VERBATIM)
  target_sources(${target} PRIVATE ${dir}/${name}.cc ${dir}/embedded/${name}.h)
  target_include_directories(${target} PRIVATE ${dir})
endfunction()
