# SPDX-License-Identifier: BSD-3-Clause
# Writes OUTPUT, C++ with the page of `carom view` and the deck of `carom demo` as texts.
# cmake -DPAGE=folder -DDECK=file -DOUTPUT=… -P embed_page.cmake
foreach(script source camera visible shaders spheres chart panel controls pictures page)  # page.js starts all
  file(READ ${PAGE}/${script}.js text)
  string(APPEND scripts "${text}")
endforeach()
file(READ ${PAGE}/view.css css)
configure_file(${PAGE}/index.html ${OUTPUT}.html @ONLY)
file(READ ${OUTPUT}.html page)
file(READ ${DECK} deck)
file(WRITE ${OUTPUT} "#include \"io/view/view.h\"\n\nconst char* const carom::kPage = R\"carom(${page})carom\";\n"
                     "const char* const carom::kDemoDeck = R\"carom(${deck})carom\";\n")
