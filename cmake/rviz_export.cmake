# rviz offers the display where package.xml names it: what is installed names it where it was built.
if(TARGET cuboid_mapping_rviz)
  install(FILES rviz_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
else()
  install(CODE "
    set(package \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CATKIN_PACKAGE_SHARE_DESTINATION}/package.xml\")
    file(READ \"\${package}\" text)
    string(REGEX REPLACE \"\n *<rviz plugin=[^>]*>\" \"\" text \"\${text}\")
    file(WRITE \"\${package}\" \"\${text}\")")
endif()
