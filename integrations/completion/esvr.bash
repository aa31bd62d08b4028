# Completion for the programs of ESVR in bash. The programs themselves name their options, so that this
# file fits every version. In zsh, run `autoload -U +X bashcompinit && bashcompinit` first.
_esvr() {
  local program=${COMP_WORDS[0]} word=${COMP_WORDS[COMP_CWORD]} command=''
  if [ "${program##*/}" = esvr-compare ]; then
    if [ "$COMP_CWORD" -eq 1 ]; then
      mapfile -t COMPREPLY < <(compgen -W 'check table curves stability' -- "$word")
      return
    fi
    command=${COMP_WORDS[1]}
  fi
  [[ $word == -* ]] || return # files are completed by the shell
  mapfile -t COMPREPLY < <(compgen -W "$("$program" $command --help options 2> /dev/null)" -- "$word")
}
complete -o default -F _esvr vdb2esvr esvr2vdb esvr-render esvr-view esvr-compare esvr-sample swc2vdb image2vdb
