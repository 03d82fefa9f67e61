# Headers that nearly every source includes are compiled once, for the product and for the tests; half of what a source costs is
# reading them. A source still includes what it uses: .ci/deep builds without.
#
#   tether_precompile(TARGET product|test)
function(tether_precompile TARGET KIND)
  if(TETHER_PRECOMPILE)
    target_precompile_headers(${TARGET} REUSE_FROM tether_precompiled_${KIND})
  endif()
endfunction()

set(CMAKE_PCH_WARN_INVALID OFF) # a room with options of its own (qp) reads the headers as text
if(TETHER_PRECOMPILE)
  set(headers <algorithm> <array> <cmath> <cstdint> <functional> <map> <memory> <optional> <set> <span> <string>
              <string_view> <utility> <variant> <vector> <Eigen/Core> <Eigen/Geometry>)
  file(WRITE ${CMAKE_BINARY_DIR}/empty.cc "")
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-fpch-preprocess)
  endif()
  add_library(tether_precompiled_product OBJECT ${CMAKE_BINARY_DIR}/empty.cc)
  target_link_libraries(tether_precompiled_product PRIVATE Eigen3::Eigen)
  target_precompile_headers(tether_precompiled_product PRIVATE ${headers})
  if(TETHER_BUILD_TESTS)
    add_library(tether_precompiled_test OBJECT ${CMAKE_BINARY_DIR}/empty.cc)
    target_link_libraries(tether_precompiled_test PRIVATE Eigen3::Eigen GTest::gtest GTest::gmock)
    target_compile_definitions(tether_precompiled_test PRIVATE TETHER_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
    target_precompile_headers(tether_precompiled_test PRIVATE ${headers} <gtest/gtest.h> <gmock/gmock.h>)
  endif()
endif()
