# A room is a folder under src/tether/, a target tether_<room> and a namespace tether::<room>.
#
#   tether_room(NAME KNOWS room... [THIRD_PARTY target...])
#
# Sources are every *.cc in it and its sub-folders; foo_test.cc becomes part of the target <room>_test, foo_benchmark.cc of
# <room>_benchmark, and foo_plugin.cc a shared object, see below. Headers are installed, and the target
# all_verify_interface_header_sets compiles each alone. THIRD_PARTY libraries stay private: their headers appear in .cc files
# only. Test helpers and oracles in testing/<room> become part of <room>_test, and of no product library.
include(GNUInstallDirs)
function(tether_room NAME)
  cmake_parse_arguments(ROOM "" "" "KNOWS;THIRD_PARTY;TEST_THIRD_PARTY" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cc)
  set(tests ${sources})
  set(benchmarks ${sources})
  list(FILTER tests INCLUDE REGEX "_test\\.cc$")
  list(FILTER benchmarks INCLUDE REGEX "_benchmark\\.cc$")
  list(FILTER sources EXCLUDE REGEX "_(test|benchmark|plugin)\\.cc$")
  if(NOT sources)
    return()
  endif()
  add_library(tether_${NAME} STATIC ${sources})
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.h)
  target_sources(tether_${NAME} PUBLIC FILE_SET HEADERS BASE_DIRS ${CMAKE_SOURCE_DIR}/src FILES ${headers})
  set_target_properties(tether_${NAME} PROPERTIES EXPORT_NAME ${NAME})
  tether_precompile(tether_${NAME} product)
  install(TARGETS tether_${NAME} EXPORT tether DESTINATION ${CMAKE_INSTALL_LIBDIR} FILE_SET HEADERS)
  list(TRANSFORM ROOM_KNOWS PREPEND tether_)
  target_link_libraries(tether_${NAME} PUBLIC ${ROOM_KNOWS} PRIVATE ${ROOM_THIRD_PARTY})
  # Test helpers of this room and of those it knows are found as "testing/<room>/…".
  file(GLOB testing_sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/testing/${NAME}/*.cc)
  set(testing_tests ${testing_sources})
  list(FILTER testing_tests INCLUDE REGEX "_test\\.cc$")
  list(APPEND tests ${testing_tests})
  list(FILTER testing_sources EXCLUDE REGEX "_test\\.cc$")
  if(TETHER_BUILD_TESTS AND tests)
    add_executable(${NAME}_test ${tests} ${testing_sources})
    target_include_directories(${NAME}_test PRIVATE ${CMAKE_SOURCE_DIR})
    target_link_libraries(${NAME}_test PRIVATE tether_${NAME} ${ROOM_TEST_THIRD_PARTY} GTest::gtest GTest::gmock
                                               GTest::gtest_main)
    target_compile_definitions(${NAME}_test PRIVATE TETHER_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
    tether_precompile(${NAME}_test test)
    gtest_discover_tests(${NAME}_test TEST_PREFIX "${NAME}." DISCOVERY_MODE PRE_TEST PROPERTIES TIMEOUT 600)
  endif()
  if(TETHER_BUILD_BENCHMARKS AND benchmarks)
    add_executable(${NAME}_benchmark ${benchmarks})
    target_include_directories(${NAME}_benchmark PRIVATE ${CMAKE_SOURCE_DIR})
    target_link_libraries(${NAME}_benchmark PRIVATE tether_${NAME} benchmark::benchmark benchmark::benchmark_main)
    add_dependencies(benchmarks ${NAME}_benchmark)
  endif()
endfunction()

# A plugin is a source <name>_plugin.cc of a room that becomes the shared object tether_<name>.so, which is loaded when it is first
# asked for (common/plugin.h), so that commands which do not use its library do not load it, and a machine may lack it.
#
#   tether_plugin(NAME target...)
#
# The targets are what it links; of ours it links nothing: what it is handed has virtual functions.
set(TETHER_BUILT_PLUGINS ${CMAKE_BINARY_DIR}/lib/tether)
set(TETHER_INSTALLED_PLUGINS ${CMAKE_INSTALL_FULL_LIBDIR}/tether)
function(tether_plugin NAME)
  add_library(tether_plugin_${NAME} MODULE ${CMAKE_CURRENT_SOURCE_DIR}/${NAME}_plugin.cc)
  set_target_properties(tether_plugin_${NAME} PROPERTIES OUTPUT_NAME tether_${NAME} PREFIX ""
                                                       LIBRARY_OUTPUT_DIRECTORY ${TETHER_BUILT_PLUGINS})
  target_include_directories(tether_plugin_${NAME} PRIVATE ${CMAKE_SOURCE_DIR}/src)
  target_link_libraries(tether_plugin_${NAME} PRIVATE Eigen3::Eigen ${ARGN})
  if(NOT TETHER_SANITIZE)
    target_link_options(tether_plugin_${NAME} PRIVATE -Wl,--no-undefined)
  endif()
  add_dependencies(tether_common tether_plugin_${NAME})
  install(TARGETS tether_plugin_${NAME} DESTINATION ${CMAKE_INSTALL_LIBDIR}/tether)
endfunction()
