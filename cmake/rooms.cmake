# A room is a folder under src/tether/, a target tether_<room> and a namespace tether::<room>.
#
#   tether_room(NAME KNOWS room... [THIRD_PARTY target...])
#
# Sources are every *.cc in it and its sub-folders; foo_test.cc becomes part of the target <room>_test, foo_benchmark.cc of
# <room>_benchmark. THIRD_PARTY libraries stay private: their headers appear in .cc files only. Test helpers and oracles in
# testing/<room> become tether_testing_<room>, which tests and benchmarks of the room link, and no product library.
function(tether_room NAME)
  cmake_parse_arguments(ROOM "" "" "KNOWS;THIRD_PARTY;TEST_THIRD_PARTY" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cc)
  set(tests ${sources})
  set(benchmarks ${sources})
  list(FILTER tests INCLUDE REGEX "_test\\.cc$")
  list(FILTER benchmarks INCLUDE REGEX "_benchmark\\.cc$")
  list(FILTER sources EXCLUDE REGEX "_(test|benchmark)\\.cc$")
  if(NOT sources)
    return()
  endif()
  add_library(tether_${NAME} STATIC ${sources})
  target_include_directories(tether_${NAME} PUBLIC ${CMAKE_SOURCE_DIR}/src)
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
    gtest_discover_tests(${NAME}_test TEST_PREFIX "${NAME}." DISCOVERY_MODE PRE_TEST PROPERTIES TIMEOUT 600)
  endif()
  if(TETHER_BUILD_BENCHMARKS AND benchmarks)
    add_executable(${NAME}_benchmark ${benchmarks})
    target_include_directories(${NAME}_benchmark PRIVATE ${CMAKE_SOURCE_DIR})
    target_link_libraries(${NAME}_benchmark PRIVATE tether_${NAME} benchmark::benchmark benchmark::benchmark_main)
    add_dependencies(benchmarks ${NAME}_benchmark)
  endif()
endfunction()
