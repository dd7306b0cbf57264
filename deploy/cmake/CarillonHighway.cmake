# Highway, which compiles the kernels for several instruction sets and chooses one at run time.

find_package(hwy CONFIG REQUIRED)
set_target_properties(hwy::hwy PROPERTIES IMPORTED_GLOBAL TRUE)

# A processor that has SSSE3 and not SSE4 is from before 2008. Sanitizers make vector code so slow to compile that it is
# compiled for one set of narrow vectors and one of wide ones.
set(disabled HWY_SSSE3)
if(CARILLON_SANITIZE)
  set(disabled "(HWY_SSSE3|HWY_SSE4|HWY_AVX3)")
endif()
set_property(TARGET hwy::hwy APPEND PROPERTY INTERFACE_COMPILE_DEFINITIONS "HWY_DISABLED_TARGETS=${disabled}")
