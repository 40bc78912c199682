/** The Studio as one HTML text: see vite.widget.config.ts. */
declare module 'virtual:studio' {
  const html: string;
  export default html;
}
