option(CARILLON_UNITY "Compile the files of a target a few at a time, which halves the time of a whole build" ON)

# Makes one compilation of each few files of a target, since most of their time goes into the same headers.
function(carillon_unity target)
  if(CARILLON_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 6)
    # g++ takes a file that another includes for a header, in which types of anonymous namespaces would be errors.
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
  endif()
  # Highway includes such a file once for each instruction set.
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "_kernels?\\.cc$")
  set_source_files_properties(${sources} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# Optimizes a target for its build: its code runs once a call, not once a row, a sample or an element. Most of a build
# went into reading and optimizing gRPC's and CLI11's templates; reading them takes four fifths of the time that is
# left, so more files share it.
function(carillon_once_a_call target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE 12)
endfunction()

# carillon_room(server_scene SOURCES a.cc b.cc [DEPENDS server_base ...] [LIBRARIES PkgConfig::x ...] [ONCE_A_CALL])
#
# One static library for one room. DEPENDS names the other rooms it may include (PUBLIC); LIBRARIES
# third-party targets, which stay inside (PRIVATE). All includes start at the root of the project.
function(carillon_room name)
  cmake_parse_arguments(ROOM "ONCE_A_CALL" "" "SOURCES;DEPENDS;LIBRARIES" ${ARGN})
  # The headers of the folder too, so that editors see them.
  file(GLOB headers CONFIGURE_DEPENDS *.h)
  add_library(carillon_${name} STATIC ${ROOM_SOURCES} ${headers})
  target_include_directories(carillon_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  list(TRANSFORM ROOM_DEPENDS PREPEND carillon_)
  target_link_libraries(carillon_${name} PUBLIC ${ROOM_DEPENDS} absl::status absl::statusor
                        PRIVATE carillon_warnings ${ROOM_LIBRARIES})
  carillon_unity(carillon_${name})
  if(ROOM_ONCE_A_CALL)
    carillon_once_a_call(carillon_${name})
  endif()
endfunction()

# carillon_program(carillond SOURCES main.cc [DEPENDS ...] [LIBRARIES ...] [ONCE_A_CALL]) lands in bin/.
function(carillon_program name)
  cmake_parse_arguments(ROOM "ONCE_A_CALL" "" "SOURCES;DEPENDS;LIBRARIES" ${ARGN})
  add_executable(${name} ${ROOM_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  list(TRANSFORM ROOM_DEPENDS PREPEND carillon_)
  target_link_libraries(${name} PRIVATE carillon_warnings ${ROOM_DEPENDS} ${ROOM_LIBRARIES})
  carillon_unity(${name})
  if(ROOM_ONCE_A_CALL)
    carillon_once_a_call(${name})
  endif()
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

# Compiles the sources of a test with the precompiled headers of carillon_test_headers. g++ looks for them in the
# folders of includes. clang, whose tools read the same command, does not: it reads the headers themselves, since it
# would stop at a file that only g++ can read.
function(carillon_use_test_headers target)
  get_target_property(folder carillon_test_headers BINARY_DIR)
  set(folder ${folder}/CMakeFiles/carillon_test_headers.dir)
  target_compile_options(${target} PRIVATE -include cmake_pch.hxx)
  target_include_directories(${target} SYSTEM PRIVATE ${folder})
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    set_property(SOURCE ${ARGN} APPEND PROPERTY OBJECT_DEPENDS ${folder}/cmake_pch.hxx.gch)
  endif()
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
                        carillon_test_options GTest::gmock_main)
  carillon_use_test_headers(${target} ${ROOM_SOURCES})
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

# carillon_tests(server/base digest event pose DEPENDS server_base [...])
#
# Tests of a folder that need the same: digest_test.cc, event_test.cc, pose_test.cc.
function(carillon_tests folder)
  cmake_parse_arguments(TESTS "" "TIMEOUT" "DEPENDS;LIBRARIES;LABELS" ${ARGN})
  set(needs ${ARGN})
  list(REMOVE_ITEM needs ${TESTS_UNPARSED_ARGUMENTS})
  foreach(test ${TESTS_UNPARSED_ARGUMENTS})
    carillon_test(${folder}/${test}_test SOURCES ${test}_test.cc ${needs})
  endforeach()
endfunction()

# carillon_program_tests(integration test_latency test_rest...)
#
# Files of Python in a folder of tests/ that run the real programs, one CTest test a file.
function(carillon_program_tests room)
  set(python ${CMAKE_BINARY_DIR}/client_sdk/python ${PROJECT_SOURCE_DIR}/client_sdk/python
             ${PROJECT_SOURCE_DIR}/tests/integration)
  list(JOIN python ":" python)
  set(environment
    PYTHONPATH=${python}
    PYTHONDONTWRITEBYTECODE=1
    CARILLON_BIN_DIR=${CMAKE_RUNTIME_OUTPUT_DIRECTORY}
    CARILLON_BUILD_DIR=${CMAKE_BINARY_DIR})
  foreach(name ${ARGN})
    add_test(NAME ${room}/${name}
             COMMAND /usr/bin/python3 -m unittest --verbose ${name}
             WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
    set_tests_properties(${room}/${name} PROPERTIES LABELS ${room} TIMEOUT 600 ENVIRONMENT "${environment}")
  endforeach()
endfunction()
