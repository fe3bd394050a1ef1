# What `cmake --install build/release` installs. Its components are those of the packages (cmake/Packages.cmake):
# programs, development (headers of libtensorray), mpi, python.
include(GNUInstallDirs)

# tensorray_pictures is loaded by programs, by libtensorray and by the Python module.
set(private_folder ${CMAKE_INSTALL_LIBDIR}/tensorray)
install(TARGETS tensorray_pictures LIBRARY DESTINATION ${private_folder} COMPONENT programs)
if(TARGET tensorray_mpi)
  install(TARGETS tensorray_mpi LIBRARY DESTINATION ${private_folder} COMPONENT mpi)
endif()
foreach(program tensorray tensorray-import tensorray-view)
  if(TARGET ${program})
    set_target_properties(${program} PROPERTIES INSTALL_RPATH "$ORIGIN/../${private_folder}")
    install(TARGETS ${program} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
  endif()
endforeach()
install(DIRECTORY ${CMAKE_BINARY_DIR}/view DESTINATION ${CMAKE_INSTALL_DATADIR}/tensorray COMPONENT programs OPTIONAL)
install(DIRECTORY scenes/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/scenes COMPONENT programs
        FILES_MATCHING PATTERN "*.json" PATTERN "data/*" PATTERN "*.tar.xz" EXCLUDE PATTERN "*.view.json" EXCLUDE)

if(TARGET _tensorray)
  # Debian's python3 looks into another folder under /usr than elsewhere.
  if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
    set(python_folder lib/python3/dist-packages)
  else()
    set(python_folder lib/python${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}/site-packages)
  endif()
  set(TENSORRAY_PYTHON_FOLDER ${python_folder} CACHE STRING "Where the Python package is installed, under the prefix")
  file(RELATIVE_PATH from_python /p/${TENSORRAY_PYTHON_FOLDER}/tensorray /p/${private_folder})
  set_target_properties(_tensorray PROPERTIES INSTALL_RPATH "$ORIGIN/${from_python}")
  install(TARGETS _tensorray LIBRARY DESTINATION ${TENSORRAY_PYTHON_FOLDER}/tensorray COMPONENT python)
  install(DIRECTORY python/tensorray/ DESTINATION ${TENSORRAY_PYTHON_FOLDER}/tensorray COMPONENT python
          FILES_MATCHING PATTERN "*.py" PATTERN "py.typed" PATTERN "__pycache__" EXCLUDE)
endif()

# Manual pages and completion of shells, made from what all programs say to --help.
if(Python3_EXECUTABLE AND TARGET tensorray-import AND TARGET tensorray-view AND NOT TENSORRAY_SANITIZE)
  set(manual ${CMAKE_BINARY_DIR}/manual)
  file(GLOB manual_sources CONFIGURE_DEPENDS tools/manual/*)
  add_custom_command(OUTPUT ${manual}/tensorray.fish
                     COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/manual/make $<TARGET_FILE:tensorray>
                             ${PROJECT_VERSION} ${manual}
                     DEPENDS ${manual_sources} tensorray tensorray-import tensorray-view VERBATIM)
  add_custom_target(manual ALL DEPENDS ${manual}/tensorray.fish)
  install(DIRECTORY ${manual}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT programs)
  install(FILES ${manual}/tensorray.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
          RENAME tensorray COMPONENT programs)
  install(FILES ${manual}/_tensorray DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT programs)
  install(FILES ${manual}/tensorray.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d
          COMPONENT programs)
endif()

include(Library)
include(Packages)
