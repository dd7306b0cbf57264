# cmake --install: the programs, the contract for clients in other languages, the unit, what to read.
include(GNUInstallDirs)
install(TARGETS carillond carillon carillon-precompute RUNTIME)
install(DIRECTORY proto/carillon DESTINATION ${CMAKE_INSTALL_DATADIR}/carillon/proto
        FILES_MATCHING PATTERN "*.proto")
install(FILES deploy/systemd/carillond.service DESTINATION lib/systemd/system)
install(FILES deploy/systemd/carillon.sysusers.conf DESTINATION lib/sysusers.d RENAME carillon.conf)
install(FILES README.md ARCHITECTURE.md CHANGELOG.md LICENSE TYPE DOC)
install(DIRECTORY docs TYPE DOC)
install(FILES proto/README.md TYPE DOC RENAME CONTRACT.md)
install(FILES precompute/LICENSE TYPE DOC RENAME LICENSE.AGPL-3.0)
