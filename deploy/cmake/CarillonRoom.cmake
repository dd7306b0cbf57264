# carillon_room(server_scene SOURCES a.cc b.cc [DEPENDS server_base ...] [LIBRARIES PkgConfig::x ...])
#
# One static library for one room. DEPENDS names the other rooms it may include (PUBLIC); LIBRARIES
# third-party targets, which stay inside (PRIVATE). All includes start at the root of the project.
function(carillon_room name)
  cmake_parse_arguments(ROOM "" "" "SOURCES;DEPENDS;LIBRARIES" ${ARGN})
  # The headers of the folder too, so that editors see them.
  file(GLOB headers CONFIGURE_DEPENDS *.h)
  add_library(carillon_${name} STATIC ${ROOM_SOURCES} ${headers})
  target_include_directories(carillon_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  list(TRANSFORM ROOM_DEPENDS PREPEND carillon_)
  target_link_libraries(carillon_${name} PUBLIC ${ROOM_DEPENDS} absl::status absl::statusor
                        PRIVATE carillon_warnings ${ROOM_LIBRARIES})
endfunction()

# carillon_program(carillond SOURCES main.cc [DEPENDS ...] [LIBRARIES ...]) lands in bin/.
function(carillon_program name)
  cmake_parse_arguments(ROOM "" "" "SOURCES;DEPENDS;LIBRARIES" ${ARGN})
  add_executable(${name} ${ROOM_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  list(TRANSFORM ROOM_DEPENDS PREPEND carillon_)
  target_link_libraries(${name} PRIVATE carillon_warnings ${ROOM_DEPENDS} ${ROOM_LIBRARIES})
endfunction()

# carillon_needs(server/synthesis/mixer_test carillond ...)
#
# What the tests of a folder need: tests_server_synthesis and tests_server build the targets given. deploy/test.sh
# FOLDER builds such a target.
function(carillon_needs test)
  cmake_path(GET test PARENT_PATH folder)
  while(folder)
    string(REPLACE "/" "_" target tests_${folder})
    if(NOT TARGET ${target})
      add_custom_target(${target})
    endif()
    if(ARGN)
      add_dependencies(${target} ${ARGN})
    endif()
    cmake_path(GET folder PARENT_PATH folder)
  endwhile()
endfunction()

# carillon_test(server/synthesis/mixer_test SOURCES mixer_test.cc [DEPENDS ...] [LIBRARIES ...] [LABELS ...])
#
# A GoogleTest program, one CTest test a TEST(); slow programs name TIMEOUT in seconds (default 120).
function(carillon_test name)
  cmake_parse_arguments(ROOM "" "TIMEOUT" "SOURCES;DEPENDS;LIBRARIES;LABELS" ${ARGN})
  string(REPLACE "/" "_" target ${name})
  add_executable(${target} ${ROOM_SOURCES})
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
  list(TRANSFORM ROOM_DEPENDS PREPEND carillon_)
  target_link_libraries(${target} PRIVATE carillon_warnings ${ROOM_DEPENDS} ${ROOM_LIBRARIES}
                        GTest::gmock_main)
  carillon_needs(${name} ${target})
  if(NOT ROOM_TIMEOUT)
    set(ROOM_TIMEOUT 120)
  endif()
  if(CARILLON_SANITIZE)
    math(EXPR ROOM_TIMEOUT "${ROOM_TIMEOUT} * 10")
  endif()
  # Discovery when ctest runs, not when building: programs that need their environment can be built
  # anywhere.
  gtest_discover_tests(${target} TEST_PREFIX "${name}." DISCOVERY_MODE PRE_TEST
                       PROPERTIES TIMEOUT ${ROOM_TIMEOUT} LABELS "${ROOM_LABELS}")
endfunction()
