# Language, warnings, sanitizers and where programs land; for every target.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()

set(CARILLON_SANITIZE "" CACHE STRING "Sanitizers for -fsanitize=, comma-separated")
if(CARILLON_SANITIZE)
  # g++ takes variables for uninitialized where the sanitizers' code hides their assignment.
  add_compile_options(-fsanitize=${CARILLON_SANITIZE} -fno-omit-frame-pointer
                      -fno-sanitize-recover=all -Wno-maybe-uninitialized)
  add_link_options(-fsanitize=${CARILLON_SANITIZE})
  if(CARILLON_SANITIZE MATCHES address)
    add_library(carillon_keep_modules OBJECT
                ${PROJECT_SOURCE_DIR}/deploy/sanitizers/keep_modules.cc)
    link_libraries($<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:$<TARGET_OBJECTS:carillon_keep_modules>>)
  endif()
endif()

# Our own code only: generated protobuf code is compiled without them. The names are those of g++; clang, which compiles
# the fuzzers, means others by some of them.
add_library(carillon_warnings INTERFACE)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  target_compile_options(carillon_warnings INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Wshadow
                                                     -Wnon-virtual-dtor -Werror)
endif()
