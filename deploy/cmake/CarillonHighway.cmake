# Highway, which compiles the kernels for several instruction sets and chooses one at run time.

find_package(hwy CONFIG REQUIRED)
set_target_properties(hwy::hwy PROPERTIES IMPORTED_GLOBAL TRUE)

# The kernels keep vectors in arrays, which those of unknown size do not allow. A processor that has SSSE3 and not SSE4
# is from before 2008. Sanitizers make vector code so slow to compile that it is compiled for one set of narrow vectors
# and one of wide ones.
set(disabled "HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128|HWY_RVV|HWY_SSSE3")
if(CARILLON_SANITIZE)
  string(APPEND disabled "|HWY_SSE4|HWY_AVX3")
endif()
set_property(TARGET hwy::hwy APPEND PROPERTY INTERFACE_COMPILE_DEFINITIONS "HWY_DISABLED_TARGETS=(${disabled})")
