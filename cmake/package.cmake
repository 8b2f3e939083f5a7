# What `cmake --install` puts beside the program and the libraries, and the Debian package that CPack makes. Components:
# runtime (the program and what belongs to it), development (libraries, headers, the CMake package), and debian (files
# that only a Debian package has).
set(documents ${PROJECT_BINARY_DIR}/colmap_graphmatch/documents)
set(share ${CMAKE_INSTALL_DATAROOTDIR})
set(doc ${share}/doc/colmap-graphmatch)

install(FILES ${documents}/graphmatch_matcher.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT runtime)
install(FILES ${documents}/graphmatch_matcher.bash RENAME graphmatch_matcher
        DESTINATION ${share}/bash-completion/completions COMPONENT runtime)
# Debian's zsh looks for what packages bring in a directory of its own.
install(CODE "
  set(functions site-functions)
  if(CMAKE_INSTALL_PREFIX MATCHES \"/usr$\" AND EXISTS /etc/debian_version)
    set(functions vendor-completions)
  endif()
  file(INSTALL ${documents}/_graphmatch_matcher DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${share}/zsh/\${functions}\")"
        COMPONENT runtime)
install(PROGRAMS scripts/colmap DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/colmap-graphmatch COMPONENT runtime)

install(FILES README.md cmake/debian/copyright DESTINATION ${doc} COMPONENT runtime)
install(DIRECTORY docs DESTINATION ${doc} COMPONENT runtime)
set(package_files ${PROJECT_BINARY_DIR}/package_files)
# Dates are those of SOURCE_DATE_EPOCH if it is set.
string(TIMESTAMP PACKAGE_DATE "%a, %d %b %Y %H:%M:%S +0000" UTC)
# There is no address for bugs of the package yet.
set(PACKAGE_MAINTAINER "The colmap-graphmatch authors <colmap-graphmatch@example.org>")
set(PACKAGE_VERSION ${PROJECT_VERSION}-1)
configure_file(cmake/debian/changelog.in ${package_files}/changelog.Debian @ONLY)
# Names as Debian wants them; the upstream changelog is CHANGELOG.md.
configure_file(CHANGELOG.md ${package_files}/changelog COPYONLY)
add_custom_command(
  OUTPUT ${package_files}/changelog.gz ${package_files}/changelog.Debian.gz
  COMMAND gzip -9nfk changelog changelog.Debian
  DEPENDS ${package_files}/changelog ${package_files}/changelog.Debian
  WORKING_DIRECTORY ${package_files} VERBATIM)
add_custom_target(graphmatch_changelogs ALL DEPENDS ${package_files}/changelog.gz)
install(FILES ${package_files}/changelog.gz DESTINATION ${doc} COMPONENT runtime)
install(FILES ${package_files}/changelog.Debian.gz DESTINATION ${doc} COMPONENT debian EXCLUDE_FROM_ALL)
install(FILES cmake/debian/lintian-overrides RENAME colmap-graphmatch DESTINATION ${share}/lintian/overrides
        COMPONENT debian EXCLUDE_FROM_ALL)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME colmap-graphmatch)
set(CPACK_PACKAGE_CONTACT "${PACKAGE_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
# One package of two components.
set(CPACK_COMPONENTS_ALL runtime debian)
set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "colmap (>= 3.8)")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "finds and matches photos of the same place, for COLMAP")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
"graphmatch_matcher takes the place of `colmap vocab_tree_matcher` in a
structure-from-motion pipeline: it finds which photos of a large, unordered
collection show the same place, matches their features, and has COLMAP verify
them. The results are in COLMAP's database, ready for `colmap mapper`.

There is no vocabulary tree to download or to learn. Each image is described
by a Fisher vector under a Gaussian mixture that is learnt from the collection
itself; the matching graph is then explored by sampling and propagation
(GraphMatch: Cui, Fragoso, Sweeney and Sen, 3DV 2017).

A wrapper that is called colmap serves programs that call COLMAP by name.")
include(CPack)
