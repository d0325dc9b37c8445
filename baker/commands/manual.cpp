#include "baker/commands/manual.h"

#include <sstream>
#include <string_view>

#include "baker/commands/help.h"
#include "baker/files/names/version.h"

namespace lumel {
namespace {

/// Text as roff shows it: no backslashes or hyphens with a meaning, no line that begins like a request.
std::string roff(std::string_view text) {
  std::string out;
  bool isStart = true;
  for (const char c : text) {
    if (isStart && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
    isStart = c == '\n';
  }
  return out;
}

std::string upper(std::string text) {
  for (char& c : text)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return text;
}

std::string header(const std::string& name, const std::string& summary) {
  std::string title = name;
  for (char& c : title)
    if (c == ' ') c = '-';
  return ".TH " + upper(title) + " 1 \"\" \"lumel " + kVersion + "\" \"User Commands\"\n.SH NAME\n" + roff(title) +
         " \\- " + roff(summary) + "\n";
}

std::string namesOf(const Option& option) {
  const std::string names = (option.shortName.empty() ? "" : "\\fB\\-" + option.shortName + "\\fR, ") + "\\fB\\-\\-" +
                            roff(option.name) + "\\fR";
  return option.placeholder.empty() ? names : names + " \\fI" + roff(option.placeholder) + "\\fR";
}

std::string entry(const Option& option) {
  const std::string names = option.positional ? "\\fI" + roff(option.placeholder) + "\\fR" : namesOf(option);
  return ".TP\n" + names + "\n" + roff(explanationOf(option)) + "\n";
}

/// The words of an option that takes one of a list: its placeholder is them, "draft|preview|production".
std::string wordsOf(const Option& option) {
  if (option.placeholder.find('|') == std::string::npos) return {};
  std::string words = option.placeholder;
  for (char& c : words)
    if (c == '|') c = ' ';
  return words;
}

const std::string& exitStatus() {
  static const std::string text = ".SH EXIT STATUS\n" + roff(kExitCodes) + ".\n";
  return text;
}

}  // namespace

std::string manPage(const Command& command) {
  std::string text = header("lumel " + command.name, command.summary);
  text += ".SH SYNOPSIS\n\\fBlumel " + roff(command.name) + "\\fR";
  for (const Option& option : command.options.all())
    if (option.required)
      text += " " + (option.positional ? "\\fI" + roff(option.placeholder) + "\\fR" : namesOf(option));
  text += " [options]\n.SH OPTIONS\n";
  std::string group;
  for (const Option& option : command.options.all()) {
    if (!option.positional && option.group != group) {
      group = option.group;
      text += ".SS " + roff(group) + "\n";
    }
    text += entry(option);
  }
  if (group != "General") text += ".SS General\n";
  for (const auto& [names, explanation] : commonOptions(command))
    text += ".TP\n\\fB" + roff(names) + "\\fR\n" + roff(explanation) + "\n";
  return text + ".SH NOTES\n.nf\n" + roff(command.examples) + "\n.fi\n" + exitStatus() +
         ".SH SEE ALSO\n.BR lumel (1)\n";
}

std::string manPageOfAll(std::span<const Command* const> commands) {
  std::string text = header("lumel", "bake lightmaps for game levels");
  text += ".SH SYNOPSIS\n\\fBlumel\\fR \\fICOMMAND\\fR [options]\n.SH COMMANDS\n";
  for (const Command* command : commands)
    text += ".TP\n\\fB" + roff(command->name) + "\\fR\n" + roff(command->summary) + ": see \\fBlumel\\-" +
            roff(command->name) + "\\fR(1)\n";
  return text + exitStatus();
}

std::string bashCompletion(std::span<const Command* const> commands) {
  std::string names, options, words;
  for (const Command* command : commands) {
    names += (names.empty() ? "" : " ") + command->name;
    options += "    " + command->name + ") options='";
    for (const Option& option : command->options.all()) {
      if (option.positional) continue;
      options += "--" + option.name + " ";
      if (const std::string list = wordsOf(option); !list.empty())
        words += "    " + command->name + ":--" + option.name + ") COMPREPLY=($(compgen -W '" + list +
                 "' -- \"$word\")); return ;;\n";
    }
    options += std::string(command->takesConfig ? "--config " : "") + "--quiet --help' ;;\n";
  }
  return "# bash completion for lumel " + std::string(kVersion) +
         "\n_lumel() {\n"
         "  local word=${COMP_WORDS[COMP_CWORD]} last=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]} options=\n"
         "  COMPREPLY=()\n"
         "  if [ \"$COMP_CWORD\" -eq 1 ] || { [ \"$command\" = help ] && [ \"$COMP_CWORD\" -eq 2 ]; }; then\n"
         "    COMPREPLY=($(compgen -W '" +
         names + " help --help --version' -- \"$word\"))\n    return\n  fi\n  case \"$command:$last\" in\n" + words +
         "  esac\n  case \"$command\" in\n" + options +
         "  esac\n"
         "  case \"$word\" in\n"
         "    -*) COMPREPLY=($(compgen -W \"$options\" -- \"$word\")) ;;\n"
         "    *) COMPREPLY=($(compgen -f -- \"$word\")) ;;\n"
         "  esac\n}\ncomplete -o filenames -F _lumel lumel\n";
}

}  // namespace lumel
