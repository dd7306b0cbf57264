# cmake --install: the C++ client (component sdk), the programs (server, precompute, cli), and what to read (doc).
# Debian's compilers, CMake and pkg-config search the folder of the architecture, also under /usr/local.
if(EXISTS /etc/debian_version AND CMAKE_LIBRARY_ARCHITECTURE AND "${CMAKE_INSTALL_LIBDIR}" MATCHES "^(lib)?$")
  set(CMAKE_INSTALL_LIBDIR lib/${CMAKE_LIBRARY_ARCHITECTURE} CACHE PATH "Folder of libraries below the prefix" FORCE)
endif()
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/carillon)
install(TARGETS carillon_client EXPORT carillonTargets ARCHIVE COMPONENT sdk INCLUDES DESTINATION include)
install(DIRECTORY client_sdk/cpp/include/carillon TYPE INCLUDE COMPONENT sdk)
# The C interface: carillon.h, libcarillon.so.
install(TARGETS carillon_c LIBRARY COMPONENT sdk NAMELINK_COMPONENT sdk PUBLIC_HEADER COMPONENT sdk)
install(DIRECTORY ${PROJECT_BINARY_DIR}/proto/carillon TYPE INCLUDE COMPONENT sdk
        FILES_MATCHING PATTERN "*.pb.h" PATTERN "*.grpc.pb.h" EXCLUDE
        PATTERN worker EXCLUDE)
install(EXPORT carillonTargets NAMESPACE carillon:: DESTINATION ${package_folder} COMPONENT sdk)
configure_package_config_file(deploy/cmake/carillonConfig.cmake.in carillonConfig.cmake
                              INSTALL_DESTINATION ${package_folder} NO_SET_AND_CHECK_MACRO)
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(carillonConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/carillonConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/carillonConfigVersion.cmake
        DESTINATION ${package_folder} COMPONENT sdk)
# Relative, so that the prefix may be chosen when installing.
file(RELATIVE_PATH CARILLON_PREFIX_FROM_PC /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(deploy/cmake/carillon-client.pc.in carillon-client.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/carillon-client.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
        COMPONENT sdk)
# The contract, for clients in other languages.
install(DIRECTORY proto/carillon/v1 DESTINATION ${CMAKE_INSTALL_DATADIR}/carillon/proto/carillon COMPONENT sdk
        FILES_MATCHING PATTERN "*.proto")

if(CARILLON_CLI)
  install(TARGETS carillon RUNTIME COMPONENT cli)
endif()
if(CARILLON_SERVER)
  install(TARGETS carillond carillon-audio RUNTIME COMPONENT server)
  install(FILES deploy/systemd/carillond.service DESTINATION lib/systemd/system COMPONENT server)
  install(FILES deploy/prometheus/alerts.yml deploy/prometheus/grafana_dashboard.json
          DESTINATION ${CMAKE_INSTALL_DATADIR}/carillon/prometheus COMPONENT server)
  install(FILES deploy/systemd/carillon.sysusers.conf DESTINATION lib/sysusers.d RENAME carillon.conf COMPONENT server)
endif()
if(CARILLON_PRECOMPUTE)
  install(TARGETS carillon-precompute RUNTIME COMPONENT precompute)
  install(FILES precompute/LICENSE TYPE DOC RENAME LICENSE.AGPL-3.0 COMPONENT precompute)
endif()
install(FILES README.md ARCHITECTURE.md CHANGELOG.md LICENSE TYPE DOC COMPONENT doc)
install(DIRECTORY docs TYPE DOC COMPONENT doc)
install(FILES proto/README.md TYPE DOC RENAME CONTRACT.md COMPONENT doc)
install(FILES proto/errors.md TYPE DOC RENAME ERRORS.md COMPONENT doc)
