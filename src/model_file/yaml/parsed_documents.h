// A document is parsed once for a whole command, however often it is loaded: for its kind, for its
// values, for each witness and for each number that is perturbed.
#pragma once

#include <list>
#include <string>
#include <utility>

#include "model_file/yaml/yaml_reader.h"

namespace mbv {

/// While one lives, YamlReader::Parse() of this thread takes a tree that it made of the same text
/// before. Trees of texts with findings are not kept, since findings name the reader's file.
class ParsedDocuments {
 public:
  static constexpr size_t kMostDocuments = 64;  ///< those used last

  ParsedDocuments();
  ~ParsedDocuments();
  ParsedDocuments(const ParsedDocuments&) = delete;
  ParsedDocuments& operator=(const ParsedDocuments&) = delete;

  /// The tree of this text, if some ParsedDocuments of this thread has it; else null.
  [[nodiscard]] static YamlNodePtr Find(const std::string& text);
  static void Keep(const std::string& text, const YamlNodePtr& root);

 private:
  std::list<std::pair<std::string, YamlNodePtr>> kept_;  // the one used last comes first
  ParsedDocuments* outer_;
};

}  // namespace mbv
