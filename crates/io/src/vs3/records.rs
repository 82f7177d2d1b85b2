//! The lines of a View3D file as records: a letter and the words after it.
//!
//! Words are parted by blanks, tabs and commas. A word that begins with `!` starts a comment, one with `*` ends the
//! file, and so does a line whose first letter is E; a line that begins with `/` is a comment. The first letter says
//! what a line is, in either case. Numbers of a surface or vertex may go on in the next lines.

/// Most words of a line that are kept; the longest record of the format has 15.
const MAX_WORDS: usize = 24;

/// One record.
#[derive(Debug)]
pub(super) struct Record<'a> {
    /// Number of its first line, from 1.
    pub line: usize,
    /// The first letter, in upper case.
    pub code: char,
    /// The first word as it stands.
    pub keyword: &'a str,
    /// The further words of its line.
    pub words: Vec<&'a str>,
    /// What follows the first word in its line, comments included.
    pub rest: &'a str,
    /// Number of the first line that goes on with it, and the words there.
    pub more: (usize, Vec<&'a str>),
}

impl<'a> Record<'a> {
    /// What follows the first word, without a comment.
    pub fn settings(&self) -> &'a str {
        self.rest.split('!').next().unwrap_or_default()
    }
}

/// The records of a text, up to its end of data.
pub(super) fn records(text: &str) -> impl Iterator<Item = Record<'_>> {
    let mut lines = text.lines().enumerate().peekable();
    let mut ended = false;
    std::iter::from_fn(move || {
        while !ended {
            let (at, line) = lines.next()?;
            let Some(keyword) = words(line).next() else {
                ended = ends(line);
                continue;
            };
            let code = keyword.chars().next().map_or(' ', |c| c.to_ascii_uppercase());
            if code == '/' {
                continue;
            }
            if code == 'E' {
                break;
            }
            let rest = &line[line.find(keyword).unwrap_or_default() + keyword.len()..];
            ended = ends(line) && !matches!(code, 'T' | 'C');
            let mut record = Record {
                line: at + 1,
                code,
                keyword,
                words: words(line).skip(1).take(MAX_WORDS).collect(),
                rest: rest.trim(),
                more: (0, Vec::new()),
            };
            if matches!(code, 'V' | 'S' | 'M' | 'N' | 'O') {
                while !ended {
                    let Some((at, line)) = lines.next_if(|(_, line)| goes_on(line)) else { break };
                    ended = ends(line);
                    let (first, more) = &mut record.more;
                    if more.is_empty() {
                        *first = at + 1;
                    }
                    more.extend(words(line).take(MAX_WORDS.saturating_sub(more.len())));
                }
            }
            return Some(record);
        }
        None
    })
}

/// Whether a line is blank, a comment, or begins with a number.
fn goes_on(line: &str) -> bool {
    words(line).next().map_or(!ends(line), |word| word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)))
}

fn parted(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c.is_whitespace() || c == ',' || c == '\0').filter(|word| !word.is_empty())
}

/// The words of a line before its comment.
fn words(line: &str) -> impl Iterator<Item = &str> {
    parted(line).take_while(|word| !word.starts_with(['!', '*']))
}

/// Whether a `*` stands in a line where a word could.
fn ends(line: &str) -> bool {
    parted(line).find(|word| word.starts_with(['!', '*'])).is_some_and(|word| word.starts_with('*'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Vec<(usize, char, Vec<&str>, Vec<&str>)> {
        records(text).map(|r| (r.line, r.code, r.words, r.more.1)).collect()
    }

    #[test]
    fn lines_have_letters_words_comments_and_an_end() {
        let text = "t A, b ! c\r\n/ no\n\n! no\nvertex 1,2\t3!x ! 4\nEnd\nV 9";
        assert_eq!(read(text), [(1, 'T', vec!["A", "b"], vec![]), (5, 'V', vec!["1", "2", "3!x"], vec![])]);
        assert_eq!(records(text).next().unwrap().rest, "A, b ! c");
        assert_eq!(read("V 1\n* V 2\nV 3").len(), 1);
        assert_eq!(read("V 1 2 * 3\nV 3"), [(1, 'V', vec!["1", "2"], vec![])]);
        assert_eq!(read("T five * six\nV 3").len(), 2);
    }

    #[test]
    fn numbers_go_on_in_the_next_lines() {
        let text = "S 1 R\n ! where\n -1. .5\n\n +2 ! z\nS 2 *\n 4";
        assert_eq!(read(text), [(1, 'S', vec!["1", "R"], vec!["-1.", ".5", "+2"]), (6, 'S', vec!["2"], vec![])]);
        assert_eq!(records(text).next().unwrap().more.0, 3);
        assert_eq!(read("C a=1\n5").last().unwrap().1, '5');
    }

    #[test]
    fn a_line_of_many_words_takes_little() {
        let text = format!("S {}\n{}", "1 ".repeat(10_000), "2\n".repeat(10_000));
        let record = records(&text).next().unwrap();
        assert_eq!((record.words.len(), record.more.1.len()), (MAX_WORDS, MAX_WORDS));
    }
}
