#pragma once
#include <boost/config.hpp>

// As Boost exports a function: a variable of C by the name of the alias, in a namespace of its own.
#define BOOST_DLL_ALIAS(function, alias)                                  \
  namespace _autoaliases                                                  \
  {                                                                       \
  extern "C" BOOST_SYMBOL_EXPORT const void* alias;                       \
  BOOST_SYMBOL_EXPORT const void* alias =                                 \
    reinterpret_cast<const void*>(reinterpret_cast<long>(&function));     \
  }
