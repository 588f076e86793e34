var Nt,mp,gx,ks,dh,hl,gp,al,_p,ph,fh,_x,Wo=Symbol.for("pv"),dl={},fl=[],xx=/^m(i|n|o|s|text|space)$/,mh=Array.isArray,xp=fl.slice,lr=Object.assign;function ar(n){n&&n.parentNode&&n.remove()}function ll(n,e,t,i,s){var r={type:n,props:e,key:t,ref:i,__k:null,__:null,__b:0,__e:null,__c:null,constructor:Wo,__v:s||++mp,__i:-1,__u:0};return!s&&Nt.vnode&&Nt.vnode(r),r}function Mt(n){return n.children}function cl(n,e){this.props=n,this.context=e,this.__g=0}function Bs(n,e){if(e==null)return n.__&&Bs(n.__,n.__i+1);for(var t;e<n.__k.length;e++)if((t=n.__k[e])&&t.__e)return t.__e;return typeof n.type!="function"||n.props.__P?null:Bs(n)}function vx(n){var e,t=n.__v,i=t.__e,s=[],r=[],o=n.__P;o&&((e=lr({constructor:Wo},t)).__v=t.__v+1,Nt.vnode&&Nt.vnode(e),gh(o,e,t,n.__n,o.namespaceURI,32&t.__u?[i]:null,s,i||Bs(t),32&t.__u,r),e.__v=t.__v,e.__.__k[e.__i]=e,wp(s,e,r),t.__=t.__e=null,e.__e!=i&&vp(e))}function vp(n){if((n=n.__)&&n.__c&&!n.props.__P)return n.__e=null,n.__k.some(function(e){return e&&(n.__e=e.__e)}),vp(n)}function fp(n){(8&n.__g||(n.__g|=8,ks.push(n),hl++))&&dh==Nt.debounceRendering||((dh=Nt.debounceRendering)||queueMicrotask)(yp)}function yp(){try{for(var n,e=1;ks.length;)ks.length>e&&ks.sort(gp),n=ks.shift(),e=ks.length,8&n.__g&&vx(n)}finally{(hl=ks.length)&&(dh||queueMicrotask)(yp)}}function bp(n,e,t,i,s,r,o,a,l,c,u){var d,h,f,m,y,g,_=i.__k||fl,b=e.length;for(l=yx(t,e,_,l,b),d=0;d<b;d++)(f=t.__k[d])!=null&&(h=~f.__i&&_[f.__i]||dl,f.__i=d,g=gh(n,f,h,s,r,o,a,l,c,u),m=f.__e,(h.ref!=f.ref||8&h.__u)&&(h.ref&&_h(h.ref,null,f,h),f.ref&&u.push(f.ref,f.__c||m,f)),y=y||m,4&f.__u?(l=Sp(f,l,n,!h.__v),h.__e&&(h.__e=null)):typeof f.type=="function"&&g!==void 0?l=g:m&&(l=m.nextSibling),f.__u&=-21);return t.__e=y,l}function yx(n,e,t,i,s){var r,o,a,l,c,u,d,h,f,m=t.length,y=m,g=0,_=0,b=n.__k=Array(s);for(r=0;r<s;r++)(o=e[r])!=null&&typeof o!="boolean"&&typeof o!="function"?(typeof o!="object"||o.constructor===String?o=b[r]=ll(null,o):mh(o)?o=b[r]=ll(Mt,{children:o}):o.constructor===Wo&&o.__b?o=b[r]=ll(o.type,o.props,o.key,o.ref,o.__v):b[r]=o,l=r+g,o.__=n,o.__b=n.__b+1,a=null,~(c=o.__i=bx(o,t,l,y))&&(y--,(a=t[c])&&(a.__u|=2)),a&&a.__v?(o.__u|=16,c==l-1?g--:c==l+1?g++:c!=l&&(c>l?g--:g++,_=1)):(~c||(s>m?g--:s<m&&g++),typeof o.type!="function"&&(o.__u|=4))):b[r]=null;if(_){for(u=[],d=[],r=0;r<s;r++)if((o=b[r])&&16&o.__u){for(g=0,h=u.length;g<h;)u[f=g+h>>1]<o.__i?g=f+1:h=f;u[g]=o.__i,d[r]=g+1}for(g=u.length;r--;)d[r]&&(d[r]==g?g--:b[r].__u|=4)}if(y)for(r=0;r<m;r++)!(a=t[r])||2&a.__u||(a.__e==i&&(i=Bs(a)),xh(a,a));return i}function Sp(n,e,t,i){var s,r,o,a;if(typeof n.type=="function"){if(n.props.__P)return e;if(s=n.__k)for(r=0;r<s.length;r++)s[r]&&(s[r].__=n,e=Sp(s[r],e,t,!1));return e}for(e&&!e.parentNode&&(e=Bs(n))&&!e.parentNode&&(e=null),o=n.__e,a=e;a&&a.nodeType==8;)a=a.nextSibling;for(o!=a&&(!i&&t.moveBefore&&o.parentNode?t.moveBefore(o,e):t.insertBefore(o,e||null)),e=o;(e=e&&e.nextSibling)&&e.nodeType==8&&!e.data.startsWith("$s"););return e}function bx(n,e,t,i){var s,r=n.key,o=n.type,a=e[t],l=a&&!(2&a.__u);if(a===null&&r==null||l&&r==a.key&&o==a.type)return t;if(i>(l?1:0)){for(s=t-1;s>=0;s--)if((a=e[s])&&!(2&a.__u)&&r==a.key&&o==a.type)return s;for(s=t+1;s<e.length;s++)if((a=e[s])&&!(2&a.__u)&&r==a.key&&o==a.type)return s}return-1}function pp(n,e,t){t==null&&(t=""),e[0]=="-"?n.setProperty(e,t):n[e]=t}function ol(n,e,t,i,s){var r,o;if(e=="style")if(typeof t=="string")n.style.cssText=t;else{if(typeof i=="string"&&(n.style.cssText=i=""),i)for(e in i)t&&e in t||pp(n.style,e);if(t)for(e in t)i&&t[e]==i[e]||pp(n.style,e,t[e])}else if(e[0]=="o"&&e[1]=="n")typeof t!="function"&&(t=null),typeof i!="function"&&(i=null),(n.__e||(n.__e={}))[e]=t,t&&i||(o=fh[e]||(fh[e]=Sx(e)),(n.__a||(n.__a={}))[e]=ph,r=e!=(e=e.replace(_p,"$1")),(e=e.slice(2))[0]<"a"&&(e=e.toLowerCase()),t?n.addEventListener(e,o,r):n.removeEventListener(e,o,r));else{if(s=="http://www.w3.org/2000/svg")e=e.replace(/xlink(H|:h)/,"h").replace(/sName$/,"s");else if(e!="width"&&e!="height"&&e!="href"&&e!="list"&&e!="form"&&e!="tabIndex"&&e!="download"&&e!="rowSpan"&&e!="colSpan"&&e!="role"&&e!="popover"&&e in n)try{return void(n[e]=t??"")}catch{}if(typeof t=="function")return;t==null||t===!1&&e[4]!="-"?n.removeAttribute(e):n.setAttribute(e,e=="popover"&&t==1?"":t)}}function Sx(n){return function(e){var t=this.__e;if(t){if(t=t[n],e[al]==null)e[al]=ph++;else if(e[al]<this.__a[n])return;return t(Nt.event?Nt.event(e):e)}}}function gh(n,e,t,i,s,r,o,a,l,c){var u,d,h,f,m,y,g,_,b,C,S,P,A,x,w,F,D,L,B=e.type;if(e.constructor!==Wo)return null;128&t.__u&&(l=32&t.__u,u=t.__c.__z)&&(e.__u|=l,d=r=[],u.nodeType==8?a=ul(u,r):r.push(u),a=r[0]||a),(u=Nt.__b)&&u(e);e:if(typeof B=="function"){h=o.length;try{if(_=e.props,b=(u=B.prototype)&&u.render,C=(u=B.contextType)&&i[u.__c],S=u?C?C.props.value:u.__:i,(f=t.__c)?(e.__c=f,2&f.__g&&(f.__g|=1)):(b?e.__c=f=new B(_,S):(e.__c=f=new cl(_,S),f.constructor=B,f.render=wx),C&&C.sub(f),f.state||(f.state={}),f.__n=i,f.__g|=8,f.__h=[],f.__k=[]),b&&(f.__s||(f.__s=f.state),B.getDerivedStateFromProps&&(f.__s==f.state&&(f.__s=lr({},f.__s)),lr(f.__s,B.getDerivedStateFromProps(_,f.__s)))),m=f.props,y=f.state,f.__v=e,t.__c){if(_!==m&&b&&!B.getDerivedStateFromProps&&f.componentWillReceiveProps&&f.componentWillReceiveProps(_,S),e.__v==t.__v&&!(8&f.__g)||!(4&f.__g)&&f.shouldComponentUpdate&&f.shouldComponentUpdate(_,f.__s,S)===!1){e.__v!=t.__v&&(f.props=_,f.state=f.__s,f.__g&=-9),e.__e=t.__e,e.__k=t.__k,e.__k.some(function(V){V&&(V.__=e)}),fl.push.apply(f.__h,f.__k),f.__k=[],f.__h.length&&o.push(f),a=Bs(t);break e}f.componentWillUpdate&&f.componentWillUpdate(_,f.__s,S),b&&f.componentDidUpdate&&f.__h.push(function(){f.componentDidUpdate(m,y,g)})}else b&&!B.getDerivedStateFromProps&&f.componentWillMount&&f.componentWillMount(),b&&f.componentDidMount&&f.__h.push(f.componentDidMount);f.context=S,f.props=_,f.__P=n,f.__g&=-5,P=Nt.__r,A=b?25:0;do f.__g&=-9,P&&P(e),u=f.render(f.props,f.state=f.__s,f.context);while(8&f.__g&&++A<25);b&&(fl.push.apply(f.__h,f.__k),f.__k=[]),f.state=f.__s,f.getChildContext&&(i=lr({},i,f.getChildContext())),b&&t.__c&&f.getSnapshotBeforeUpdate&&(g=f.getSnapshotBeforeUpdate(m,y)),x=u&&u.type===Mt&&u.key==null?u.props.children:u,_.__P&&(u=a,s=(n=_.__P).namespaceURI,l=r=null,t.props&&t.props.__P!=n&&(t.__k.some(function(V){V&&xh(V,V)}),t.__k=null),a=t.__k?Bs(t,0):null),a=bp(n,mh(x)?x:[x],e,t,i,s,r,o,a,l,c),_.__P&&(e.__e=null,a=u),e.__u&=-161,d&&d.some(ar),f.__h.length&&o.push(f),1&f.__g&&(f.__g&=-4)}catch(V){if(o.length=h,e.__v=null,l||r)if(V&&V.then){if(e.__u|=128|l,r){for(~(D=r.indexOf(a||void 0))||(D=r.length);(L=r[D-1])&&L.nodeType==8;)D--;for(;D<r.length;D++)if(L=r[D])if(r[D]=null,w){if(L==F)break}else{if(L.nodeType!=8)break;L.data.startsWith("$s")&&(F=ul(w=L))}}if(!w){for(;a&&a.nodeType==8&&a.nextSibling;)a=a.nextSibling;w=a}(u=ul(w=e.__c.__z||(e.__c.__z=w)))?(e.__e=w,a=u):e.__e=a,a=a&&a.nextSibling}else r&&r.some(ar);else e.__e=t.__e;e.__k||(e.__k=t.__k||[]),V&&V.then||Mp(e),Nt.__e(V,e,t)}}else a=e.__e=Mx(t.__e,e,t,i,s,r,o,l,c,n);return(u=Nt.diffed)&&u(e),a}function ul(n,e){if(n&&n.nodeType==8&&n.data.startsWith("$s"))for(var t=1;n=n.nextSibling;){if(n.nodeType==8){if(n.data.startsWith("$s"))t++;else if(n.data.startsWith("/$s")&&!--t)return n}e&&e.push(n)}}function Mp(n){n&&(n.__c&&(n.__c.__g|=4),n.__k&&n.__k.some(Mp))}function wp(n,e,t){for(var i=0;i<t.length;)_h(t[i++],t[i++],t[i++]);Nt.__c&&Nt.__c(e,n),n.some(function(s){try{n=s.__h,s.__h=[],n.some(function(r){r.call(s)})}catch(r){Nt.__e(r,s.__v)}})}function Mx(n,e,t,i,s,r,o,a,l,c){var u,d,h,f,m,y,g,_,b=t.props||dl,C=e.props,S=e.type;if(S=="svg"?s="http://www.w3.org/2000/svg":S=="math"?s="http://www.w3.org/1998/Math/MathML":s||(s="http://www.w3.org/1999/xhtml"),r){for(u=0;u<r.length;u++)if((m=r[u])&&(S?m.localName==S:m.nodeType==3)){n=m,r[u]=null;break}}if(!n){if(_=c.ownerDocument||document,!S)return _.createTextNode(C);n=_.createElementNS(s,S,C.is?C:c),a&&(Nt.__m&&Nt.__m(e,r),a=!1),r=null}if(S){if(c=S=="template"&&n.content||n,r=S=="textarea"&&C.defaultValue!=null?null:r&&xp.call(c.childNodes),!a&&r)for(b={},u=0;u<n.attributes.length;u++)b[(m=n.attributes[u]).name]=m.value;for(u in b)m=b[u],u=="dangerouslySetInnerHTML"?h=m:u=="children"||u in C||u=="value"&&"defaultValue"in C||u=="checked"&&"defaultChecked"in C||ol(n,u,null,m,s);for(u in C)m=C[u],u=="children"?f=m:u=="dangerouslySetInnerHTML"?d=m:u=="value"?y=m:u=="checked"?g=m:a&&typeof m!="function"||b[u]===m||ol(n,u,m,b[u],s);d?(a||h&&(d.__html==h.__html||d.__html==n.innerHTML)||(n.innerHTML=d.__html),e.__k=[]):(h&&(n.textContent=""),(S=="foreignObject"||s=="http://www.w3.org/1998/Math/MathML"&&xx.test(S))&&(s="http://www.w3.org/1999/xhtml"),bp(c,mh(f)?f:[f],e,t,i,s,r,o,r?r[0]:t.__k&&Bs(t,0),a,l),r&&r.some(ar)),a&&S!="textarea"||(u="value",S=="progress"&&y==null?n.removeAttribute(u):y==null||y===n[u]&&(S!="progress"||y)||ol(n,u,y,b[u],s),u="checked",g!=null&&g!=n[u]&&ol(n,u,g,b[u],s))}else b===C||a&&n.data==C||(n.data=C);return n}function _h(n,e,t,i){try{typeof n=="function"?e?e.__x=n(e)||1:i&&(i=i.__c||i.__e)&&(e=i.__x)&&(i.__x=null,typeof e=="function"?e():n(null)):n.current=e}catch(s){Nt.__e(s,t)}}function xh(n,e,t){var i,s,r,o;if(Nt.unmount&&Nt.unmount(n),!(i=n.ref)||i.current&&i.current!=n.__e||_h(i,null,e,n),i=n.__c){if(i.componentWillUnmount)try{i.componentWillUnmount()}catch(a){Nt.__e(a,e)}i.__P=i.__n=null}if(i=n.__k)for(o=0;o<i.length;o++)i[o]&&xh(i[o],e,typeof n.type!="function"||t&&!n.props.__P);!t&&(i=n.__c)&&(i=i.__z)&&(s=ul(i,r=[]))&&(i==n.__e&&r.some(ar),ar(s),ar(i)),t||ar(n.__e),n.__e=n.__c=n.__=null}function wx(n,e,t){return this.constructor(n,t)}function Tp(n,e){var t,i,s,r;Nt.__&&Nt.__(n,e),e.nodeType==9&&(e=e.documentElement),i=(t=n&&32&n.__u)?null:e.__k,e.__k=ll(Mt,{children:[n]}),s=[],r=[],gh(e,e.__k,i||dl,dl,e.namespaceURI,i?null:e.firstChild?xp.call(e.childNodes):null,s,i?i.__e:e.firstChild,t,r),wp(s,e.__k,r),e.__k.props.children=null}Nt={__e:function(n,e,t,i){for(var s,r,o;e=e.__;)if((s=e.__c)&&!(1&s.__g)){s.__g|=4;try{if((o=(r=s.constructor)&&r.getDerivedStateFromError)&&s.setState(r.getDerivedStateFromError(n)),s.componentDidCatch&&(s.componentDidCatch(n,i||{}),o=1),o&&8&s.__g)return void(s.__g|=2)}catch(a){n=a}}throw hl=0,n}},mp=0,gx=function(n){return n!=null&&n.constructor===Wo},cl.prototype.setState=function(n,e){var t=this.__s;t&&t!=this.state||(t=this.__s=lr({},this.state)),typeof n=="function"&&(n=n(lr({},t),this.props)),n&&(lr(t,n),this.__v&&(e&&this.__k.push(e),fp(this)))},cl.prototype.forceUpdate=function(n){this.__v&&(this.__g|=4,n&&this.__h.push(n),fp(this))},cl.prototype.render=Mt,ks=[],hl=0,gp=function(n,e){return n.__v.__b-e.__v.__b},al=Symbol(),_p=/(PointerCapture)$|Capture$/i,ph=0,fh={},_x=0;var qo,bn,vh,Ep,yh=Object.is,pl=0,Up=[],bh=[],gn=Nt,Ap=gn.__b,Cp=gn.__r,Rp=gn.diffed,Pp=gn.__c,Ip=gn.unmount,Lp=gn.__;function Mh(n,e){gn.__h&&gn.__h(bn,n,pl||e),pl=0;var t=bn.__H||(bn.__H={__:[],__h:[]});return n>=t.__.length&&t.__.push({}),t.__[n]}function Fe(n){return pl=1,Tx(Fp,n)}function Tx(n,e,t){var i=Mh(qo++,2);if(i.t=n,!i.__c&&(i.__=[t?t(e):Fp(void 0,e),function(r){var o=(i.__N||i.__)[0],a=i.t(o,r);yh(o,a)||(i.__N=[a,i.__[1]],i.__c.setState({}))}],i.__c=bn,!bn.__f)){bn.__f=!0;var s=bn.shouldComponentUpdate;bn.shouldComponentUpdate=function(r,o,a){var l=this.__H;if(!l)return!0;var c=!1,u=this.props!=r;if(l.__.some(function(h){h.__N&&(c=!0,yh(h.__[0],h.__N[0])||(u=!0))}),s){var d=s.call(this,r,o,a);return c?d||u:d}return!c||u}}return i.__}function vt(n,e){var t=Mh(qo++,3);!gn.__s&&Op(t.__H,e)&&(t.__P=!0,t.__=n,t.u=e,bn.__H.__h.push(t))}function Kt(n){return pl=5,Yo(function(){return{current:n}},[])}function Yo(n,e){var t=Mh(qo++,7);return Op(t.__H,e)&&(t.__=n(),t.__H=e),t.__}function Ex(){var n;do{for(;n=bh.shift();)try{Xo(n)}catch(t){gn.__e(t,{__:(n=n.__P)&&n.__v})}for(;n=Up.shift();){var e=n.__H;if(n.__P&&e)try{e.__h.some(Xo),e.__h.some(Sh),e.__h=[]}catch(t){e.__h=[],gn.__e(t,n.__v)}}}while(bh.length)}gn.__b=function(n){bn=null,Ap&&Ap(n)},gn.__=function(n,e){n&&e.__k&&e.__k.__m&&(n.__m=e.__k.__m),Lp&&Lp(n,e)},gn.__r=function(n){Cp&&Cp(n),qo=0;var e=(bn=n.__c).__H;e&&(vh==bn?bn.__h=[]:(e.__h.some(Xo),e.__h.some(Sh),qo=0),e.__h=[],e.__.some(function(t){t.__N&&(t.__=t.__N),t.u=t.__N=void 0})),vh=bn},gn.diffed=function(n){Rp&&Rp(n);var e=n.__c;e&&e.__H&&(e.__H.__h.length&&Np(Up.push(e)),e.__H.__.some(function(t){t.u&&(t.__H=t.u)})),vh=bn=null},gn.__c=function(n,e){e.some(function(t){try{t.__h.some(Xo),t.__h=t.__h.filter(function(i){return!i.__||Sh(i)})}catch(i){t.__h=[function(){throw i}]}}),Pp&&Pp(n,e)},gn.unmount=function(n){Ip&&Ip(n);var e,t,i=n.__c;i&&i.__H&&(i.__H.__.some(function(s){try{if(s.__P&&s.__c){if(t===void 0){for(t=n.__;t&&(!t.__c||!t.__c.__P);)t=t.__;t=t&&t.__c}s.__P=t,Np(bh.push(s))}else Xo(s)}catch(r){e=r}}),i.__H=void 0,e&&gn.__e(e,i.__v))};var Dp=typeof requestAnimationFrame=="function";function Ax(n){var e,t=function(){clearTimeout(i),Dp&&cancelAnimationFrame(e),setTimeout(n)},i=setTimeout(t,35);Dp&&(e=requestAnimationFrame(t))}function Np(n){n!=1&&Ep==gn.requestAnimationFrame||((Ep=gn.requestAnimationFrame)||Ax)(Ex)}function Xo(n){var e=bn,t=n.__c;typeof t=="function"&&(n.__c=void 0,t()),bn=e}function Sh(n){var e=bn;n.__c=n.__(),bn=e}function Op(n,e){return!n||n.length!=e.length||e.some(function(t,i){return!yh(t,n[i])})}function Fp(n,e){return typeof e=="function"?e(n):e}var wh="cdpr-key",Cx="robot",ml=()=>new URLSearchParams(location.hash.slice(1)),kp=n=>[...n.keys()].find(e=>e!=="key"&&n.get(e)==="")??Cx,ps=(n,e={})=>`#${[n,...Object.keys(e).length?[new URLSearchParams(e)]:[]].join("&")}`;function Bp(){let n=ml(),e=n.get("key");return e&&(sessionStorage.setItem(wh,e),history.replaceState(null,"",ps(kp(n)))),sessionStorage.getItem(wh)??""}var zp=n=>sessionStorage.setItem(wh,n);addEventListener("hashchange",()=>ml().has("key")&&location.reload());function gl(){let[n,e]=Fe(ml);return vt(()=>{let t=()=>e(ml());return addEventListener("hashchange",t),()=>removeEventListener("hashchange",t)},[]),{view:kp(n),args:n}}var si=class extends Error{},Rx="time_s,tension_N,tension_measured,pose,pose_setpoint",Px=30,Vp=1e3,Ix=4e3,Lx=401,$o=Bp(),ms=()=>$o!=="";function Th(n){$o=n,zp(n)}async function kt(n,e,t,i){let s={};$o&&(s.Authorization=`Bearer ${$o}`),t!==void 0&&(s["Content-Type"]="application/json"),i&&(s["X-Control-Token"]=i);let r;try{r=await fetch(e,{method:n,headers:s,body:t===void 0?null:JSON.stringify(t)})}catch{throw new si("The daemon does not answer. Is `cdpr run` still running?")}r.status===Lx&&Th("");let o=await r.text();if(r.ok)return JSON.parse(o);let a=o;try{a=JSON.parse(o).error}catch{}throw new si(a)}async function xl(n,e){return $o&&(e.ticket=(await kt("POST","/ticket")).ticket),new WebSocket(`ws://${location.host}${n}?${new URLSearchParams(e)}`)}function Gp(n){(async()=>{for(;;){try{await Dx(await xl("/live",{rate_Hz:String(Px),fields:Rx}),n)}catch{}n.connected(!1),await new Promise(e=>setTimeout(e,Vp))}})()}function Dx(n,e){return new Promise(t=>{let i=Date.now(),s=setInterval(()=>{Date.now()-i>Ix&&n.close()},Vp);n.onmessage=({data:r})=>{i=Date.now();let o=JSON.parse(r);o.kind==="cycle"?e.cycle(o):o.kind==="status"?e.status(o.status):o.kind==="event"?e.event(o.event):o.kind==="description"&&e.description(o.description),e.connected(!0)},n.onclose=()=>{clearInterval(s),t()}})}var Nx=2,Ux=500,Ox=5e3,_l=class{#e=null;#t="";#n=0;#r=0;#i=null;#s=new Map;changed=()=>{};get held(){return this.#t!==""}cancel(){this.#r++}stop(){this.cancel(),this.#e?.send(JSON.stringify({do:"hold",client:Vn()}))}async#o(){if(this.held)return;let e=this.#r,t=performance.now();if(this.#i??=this.#l().finally(()=>this.#i=null),await this.#i,this.#r!==e)throw new si("Cancelled: you have stopped the robot.");if(performance.now()-t>Ox)throw new si("The daemon answered late, so nothing was started. Try again.")}async#l(){let e=await xl("/control",{client:Vn(),ttl_s:String(Nx)});await new Promise((i,s)=>{e.onmessage=({data:r})=>{let o=JSON.parse(r);o.kind==="held"?(this.#t=o.token,this.#e=e,this.changed(),i()):(this.#s.get(o.id)?.(o),this.#s.delete(o.id))},e.onclose=({reason:r})=>{this.#e===e&&this.#c(r||"The connection to the daemon was lost."),s(new si(r||"The daemon did not give this page the right to move."))}});let t=setInterval(()=>{this.#e!==e?clearInterval(t):e.send(JSON.stringify({do:"renew"}))},Ux)}release(){this.#e?.close()}async enable(){await this.#o(),await kt("POST","/enable",{client:Vn(),program:"hold"},this.#t)}async program(e,t={}){await this.#a({do:"program",program:e,wanted:t})}async set(e){await this.#a({do:"set",wanted:e})}async request(e,t){return await this.#o(),kt("POST",e,t,this.#t)}async#a(e){await this.#o();let t=++this.#n,i=await new Promise(s=>{this.#s.set(t,s),this.#e?.send(JSON.stringify({...e,id:t,client:Vn()}))});if(!i.ok)throw new si(i.error??"refused")}async procedure(e){return await this.#o(),kt("POST","/procedure",{client:Vn(),...e},this.#t)}#c(e){this.#t="",this.#e=null;for(let t of this.#s.values())t({ok:!1,error:e});this.#s.clear(),this.changed()}};function Vn(){let n="cdpr-client",e=sessionStorage.getItem(n);if(e)return e;let t=`page ${Math.floor(Math.random()*65536).toString(16).padStart(4,"0")}`;return sessionStorage.setItem(n,t),t}var Or=n=>kt("POST",n,{client:Vn()});async function Hp(n){let{ticket:e}=await kt("POST","/ticket");Eh(`${n}?ticket=${e}`,"")}function Eh(n,e){let t=document.createElement("a");t.href=n,t.download=e,t.click()}var Wp={configure:"Boot the drives",check:"Check the bus",enable:"Enable",tighten:"Tighten","tighten-home":"Platform stands at home: tighten",acknowledge:"Acknowledge",move:"Move"},Fx={"tighten slack":"Winding in the slack of the cables","tighten pull":"Pulling the cables tight","tighten below":"Measuring friction with less tension","tighten beyond":"Measuring friction with more tension","tighten back":"Returning to the first tensions","tighten lengths":"Measuring the cable lengths","tighten index":"Searching the index of each motor","lower home":"Moving home, above the stand","lower down":"Lowering the platform","lower fade":"Slackening the cables","path to the path":"Moving to the path","path path":"Following the path"},cr=n=>n.program_progress??{},Ah=n=>n.last_stop??{fallen:!1,broken:[]},kx=n=>{let e=n.trim();if(!e)return"";let t=e[0].toUpperCase()+e.slice(1);return/[.!?]$/.test(t)?t:`${t}.`},Fn=(n,e,t="",i=null)=>({tone:n,title:e,detail:kx(t),next:i});function Xp(n,e,t){if(!t&&!ms())return Fn("off","This page needs its key","Open the address that `cdpr page` prints, or enter the key");if(!t||!n)return Fn("off","No connection","The daemon does not answer. This page keeps trying");switch(n.state){case"starting":return Fn("busy","Starting","The control loop is starting");case"dead":return Fn("fault","The control loop has ended",`${n.reason}. Start it again with \`cdpr run\``);case"fault":return Bx(n);case"unconfigured":return Fn("off","Drives not booted",n.reason,"configure");case"inactive":return Fn("off","No power",n.reason||"The drives are booted","check");case"ready":return n.read_only?Fn("ready","Listening only",n.reason||"Another master moves this robot"):zx(n);case"active":return Vx(n,e);default:return Fn("off",n.state,n.reason)}}function Bx(n){let e=n.faults.map(o=>o.text),[t=n.reason,...i]=e,s=Ah(n).broken.length?"Repair the cable, then acknowledge":"Remove the cause, then acknowledge",r=i.length?`${s}. After it: ${i.join("; ")}`:s;return Fn("fault",`Fault: ${t}`,r,"acknowledge")}function zx(n){let{fallen:e,broken:t}=Ah(n),i=[n.reason];return t.length?i.push("Repair the cable before you enable"):e&&i.push("The platform has come down: look at it before you enable"),Fn("ready","No power",i.filter(Boolean).join(". ")||"The drives are ready. Keep clear of the robot","enable")}function Vx(n,e){let t=cr(n);if(n.reacting!=="none")return Fn("busy","Stopping",n.reason);let i=Fx[`${n.program} ${t.path?.stage??t.stage??""}`];if(n.program==="tighten"&&t.tight===!1)return Fn("busy",i??"Tightening",t.trouble);if(n.program==="lower")return(t.done??0)<1?Fn("busy",i??"Lowering the platform",t.trouble):Fn("ready","On its stand","The cables are loose, the power is on","tighten");if(e?.platform&&t.tight===!1)return Gx(n);if(t.done!==void 0&&t.done<1&&n.program!=="hold")return Fn("busy",i??"Moving",t.held_back||t.missing||t.trouble);let s=t.trouble||n.failure||n.reason;return Fn("on",e?.platform?"Holding the platform":"Holding",s,"move")}function Gx(n){let{fallen:e,broken:t}=Ah(n),i=e||t.length>0,s=i?"The cables are slack. Put the platform on its stand, upright, then tighten from there":n.failure||"The cables are slack";return Fn("ready","Power on",s,i?"tighten-home":"tighten")}var qp=60,Ch=class{status=null;description=null;connected=!1;events=[];rejected="";preview=null;right=new _l;cycles=new Set;#e=new Set;constructor(){this.right.changed=()=>this.change(),Gp({description:e=>this.change({description:e}),status:e=>this.change({status:e}),event:e=>this.change({events:[e,...this.events.filter(t=>t.number!==e.number)].slice(0,qp)}),cycle:e=>this.cycles.forEach(t=>t(e)),connected:e=>{e===this.connected&&e||(this.change({connected:e}),e&&this.#t())}})}change(e={}){Object.assign(this,e),this.#e.forEach(t=>t())}async#t(){try{let{events:e}=await kt("GET","/events");this.change({events:e.reverse().slice(0,qp)})}catch(e){if(!(e instanceof si))throw e}}listen(e){return this.#e.add(e),()=>this.#e.delete(e)}async attempt(e){this.change({rejected:""});try{await e()}catch(t){if(!(t instanceof si))throw t;this.change({rejected:t.message})}}},rt=new Ch;function _t(){let[,n]=Fe(0);return vt(()=>{let e=rt.listen(()=>n(t=>t+1));return n(t=>t+1),()=>{e()}},[]),rt}function Zo(n,e){vt(()=>(rt.cycles.add(n),()=>{rt.cycles.delete(n)}),e)}var Hx=Symbol.for("pv"),Wx=0;function p(n,e,t,i,s,r){e||(e={});var o,a,l=e;if("ref"in l&&typeof n!="function")for(a in l={},e)a=="ref"?o=e[a]:l[a]=e[a];var c={type:n,props:l,key:t,ref:o,__k:null,__:null,__b:0,__e:null,__c:null,constructor:Hx,__v:--Wx,__i:-1,__u:0};return(s||r)&&(c.__source=s,c.__self=r),Nt.vnode&&Nt.vnode(c),c}var Rh=()=>{rt.right.stop(),rt.attempt(()=>Or("/hold"))},Xx=()=>{rt.right.cancel(),rt.attempt(()=>Or("/disable"))};function Yp(){return vt(()=>{let n=t=>t instanceof HTMLInputElement&&t.type==="password",e=t=>{t.code!=="Space"||n(t.target)||(t.preventDefault(),t.type==="keydown"&&!t.repeat&&Rh())};return addEventListener("keydown",e,!0),addEventListener("keyup",e,!0),()=>{removeEventListener("keydown",e,!0),removeEventListener("keyup",e,!0)}},[]),p("button",{class:"stop",onPointerDown:Rh,onClick:n=>n.detail===0&&Rh(),title:"Brake and hold with power: press, or space bar",children:["Stop ",p("kbd",{children:"space"})]})}function $p(){let{status:n,connected:e}=_t(),t=e&&n?.state!=="active";return p("button",{class:"power",disabled:t,onClick:Xx,title:"Stop the motion, then switch the power off",children:"Power off"})}var qx={configure:()=>Or("/configure"),check:()=>Or("/check"),enable:()=>rt.right.enable(),tighten:()=>rt.right.program("tighten"),"tighten-home":()=>rt.right.program("tighten",{from:"home"}),acknowledge:()=>Or("/acknowledge")};function Dh(){let{status:n,description:e,connected:t}=_t();return Xp(n,e,t)}var Yx=500;function $x(n){let[e,t]=Fe(null);return vt(()=>{let i=setTimeout(()=>t(n),Yx);return()=>clearTimeout(i)},[n]),e===n}function Zp(){let{rejected:n}=_t();return n?p("p",{class:"rejected",role:"alert",children:[n," ",p("button",{class:"plain",onClick:()=>rt.change({rejected:""}),children:"Close"})]}):null}function Jp(){_t();let{tone:n,title:e,detail:t,next:i}=Dh(),[s,r]=Fe(!1),o=$x(i),a=async l=>{r(!0),await rt.attempt(qx[l]),r(!1)};return p("section",{class:`card situation ${n}`,"aria-label":"State and next step",children:[p("div",{children:[p("h1",{"aria-live":"polite",children:e}),t&&p("p",{children:t})]}),i&&i!=="move"&&ms()&&p("button",{class:"next",disabled:s||!o,onClick:()=>{a(i)},children:Wp[i]}),!ms()&&p(Zx,{})]})}function Zx(){let[n,e]=Fe("");return p("form",{class:"key",onSubmit:t=>{t.preventDefault(),Th(n.trim()),location.reload()},children:[p("label",{children:["Key ",p("input",{type:"password",value:n,autocomplete:"off",onInput:t=>e(t.currentTarget.value)})]}),p("button",{disabled:!n.trim(),children:"Use the key"})]})}var Jx=[["cut-cable","Cut the cable"],["slip","Let the cable slip"],["drive-fault","Fault in the drive"],["encoder-jump","Encoder jumps"],["silence","Drive falls silent"]];function Kp(){let{description:n}=_t(),[e,t]=Fe(0);if(!n?.simulated||!ms())return null;let i=(r,o)=>kt("POST","/simulated-fault",{axis:o,fault:r,client:Vn()}),s=async()=>{for(let r of n.axes.keys())await i("mend",r)};return p("section",{class:"card","aria-labelledby":"simulation",children:[p("h2",{id:"simulation",children:"Break the simulation"}),p("div",{class:"row",children:p("label",{children:["Axis ",p("select",{value:e,onChange:r=>t(Number(r.currentTarget.value)),children:n.axes.map(({name:r},o)=>p("option",{value:o,children:r},r))})]})}),p("div",{class:"row",children:[Jx.map(([r,o])=>p("button",{onClick:()=>{rt.attempt(()=>i(r,e))},children:o},r)),p("button",{onClick:()=>{rt.attempt(s)},children:"Mend everything"}),p("button",{onClick:()=>{rt.attempt(()=>i("put-back",0))},title:"Carry a fallen platform back to its stand",children:"Put the platform back"})]})]})}var Ph=[1,10,100],Ih=[.5,2,5],Jo=Math.PI/180;function jp(){let{description:n,status:e,right:t}=_t(),i=n?.platform;if(!i||!e||!ms())return null;let s=e.state==="active"&&cr(e).tight!==!1,r=e.control.held&&!t.held?e.control.client:null;return p("section",{class:"card","aria-labelledby":"move",children:[p("h2",{id:"move",children:"Move"}),!s&&p("p",{class:"quiet",children:"The platform can move once the power is on and the cables are tight."}),r&&p("p",{class:"quiet",children:[r," has the right to move."]}),p("fieldset",{disabled:!s||r!==null,children:[p("legend",{class:"hidden",children:"Move the platform"}),p(Kx,{platform:i}),p(jx,{platform:i}),p("div",{class:"row",children:[p("button",{onClick:()=>{rt.attempt(()=>t.program("lower"))},title:"Move home and down onto the stand",children:"Lower"}),t.held&&p("button",{class:"plain",onClick:()=>t.release(),children:"Give up the right to move"})]})]})]})}var Lh=n=>n.controlled.filter(e=>e.length===1),Qp=n=>n.controlled.filter(e=>e.length>1);function Kx({platform:n}){let e=[...Lh(n),...Qp(n)],t=Lh(n).length,i=n.workspace_min_m.map((f,m)=>Math.round(500*(f+n.workspace_max_m[m]))),[s,r]=Fe(()=>e.map((f,m)=>String(m<t?i[m]:0))),o=s.map(Number),a=s.every((f,m)=>f.trim()!==""&&Number.isFinite(o[m])),l={position_m:o.slice(0,t).map(f=>f/1e3),rotation_rad:o.slice(t).map(f=>f*Jo)},c=f=>f<t?[1e3*n.workspace_min_m[f],1e3*n.workspace_max_m[f]]:[-n.workspace_angle_rad/Jo,n.workspace_angle_rad/Jo],u=f=>{r(f);let m=f.map(Number);rt.change({preview:m.every(Number.isFinite)?{position_m:m.slice(0,t).map(y=>y/1e3),rotation_rad:m.slice(t).map(y=>y*Jo)}:null})},d=()=>{rt.change({preview:null});let f=l.rotation_rad.length?l:{position_m:l.position_m};rt.attempt(()=>rt.right.program("pose",f))},h=Object.entries(n.poses_m);return p("form",{onSubmit:f=>{f.preventDefault(),a&&d()},children:[p("div",{class:"target",onFocusCapture:()=>u(s),onBlurCapture:()=>rt.change({preview:null}),children:e.map((f,m)=>{let[y,g]=c(m);return p("label",{children:[p("span",{children:[f,", ",m<t?"mm":"deg"]}),p("input",{inputMode:"decimal",value:s[m],"aria-describedby":`range-${f}`,onInput:_=>u(s.map((b,C)=>C===m?_.currentTarget.value:b))}),p("small",{id:`range-${f}`,children:[y.toFixed(0)," to ",g.toFixed(0)]})]},f)})}),p("div",{class:"row",children:[p("button",{class:"go",disabled:!a,children:"Go"}),h.map(([f,m])=>p("button",{type:"button",onClick:()=>u([...m.map(y=>String(Math.round(1e3*y))),...s.slice(t)]),children:f},f))]})]})}function jx({platform:n}){let[e,t]=Fe(1),[i,s]=Fe("room"),r=Lh(n),o=Qp(n),a=(c,u,d,h)=>{let f=Array.from({length:u},(m,y)=>y===d?h:0);rt.attempt(()=>rt.right.program("pose",{[c]:f,frame:i}))},l=(c,u,d,h,f,m)=>p("div",{class:"jog",children:[p("button",{type:"button","aria-label":`${c} minus ${m}`,onClick:()=>a(u,d,h,-f),children:"\u2212"}),p("span",{children:c}),p("button",{type:"button","aria-label":`${c} plus ${m}`,onClick:()=>a(u,d,h,f),children:"+"})]},c);return p("div",{class:"jogging",children:[p("div",{class:"row",children:[p("label",{children:["Step ",p("select",{value:e,onChange:c=>t(Number(c.currentTarget.value)),children:Ph.map((c,u)=>p("option",{value:u,children:[c," mm",o.length?`, ${Ih[u]} deg`:""]},c))})]}),o.length>0&&p("label",{children:["along ",p("select",{value:i,onChange:c=>s(c.currentTarget.value),children:[p("option",{value:"room",children:"the room's axes"}),p("option",{value:"platform",children:"the platform's axes"})]})]})]}),p("div",{class:"row",children:[r.map((c,u)=>l(c,"distance_m",r.length,u,Ph[e]/1e3,`${Ph[e]} mm`)),o.map((c,u)=>l(c,"turn_rad",o.length,u,Ih[e]*Jo,`${Ih[e]} deg`))]})]})}var Ks={LEFT:0,MIDDLE:1,RIGHT:2,ROTATE:0,DOLLY:1,PAN:2},js={ROTATE:0,PAN:1,DOLLY_PAN:2,DOLLY_ROTATE:3},Dm=0,hd=1,Nm=2;var Oa=1,Um=2,_o=3,Qs=0,ti=1,ns=2,pr=0,xo=1,dd=2,fd=3,pd=4,Om=5;var mr=100,Fm=101,km=102,Bm=103,zm=104,Vm=200,Gm=201,Hm=202,Wm=203,md=204,gd=205,Xm=206,qm=207,Ym=208,$m=209,Zm=210,Jm=211,Km=212,jm=213,Qm=214,Kl=0,jl=1,Ql=2,no=3,ec=4,tc=5,nc=6,ic=7,_d=0,eg=1,tg=2,is=0,xd=1,vd=2,yd=3,bd=4,Sd=5,Md=6,wd=7;var Td=300,gr=301,vo=302,Ic=303,Lc=304,sc=1e3,Qi=1001,rc=1002,Nn=1003,ng=1004;var Fa=1005;var Qn=1006,Dc=1007;var Es=1008;var oi=1009,Ed=1010,Ad=1011,yo=1012,Nc=1013,Fi=1014,ki=1015,Bi=1016,Uc=1017,Oc=1018,_r=1020,Cd=35902,Rd=35899,Pd=1021,Id=1022,zi=1023,Ss=1026,As=1027,Ld=1028,Fc=1029,er=1030,kc=1031;var Bc=1033,ka=33776,Ba=33777,za=33778,Va=33779,zc=35840,Vc=35841,Gc=35842,Hc=35843,Wc=36196,Xc=37492,qc=37496,Yc=37488,$c=37489,Ga=37490,Zc=37491,Jc=37808,Kc=37809,jc=37810,Qc=37811,eu=37812,tu=37813,nu=37814,iu=37815,su=37816,ru=37817,ou=37818,au=37819,lu=37820,cu=37821,uu=36492,hu=36494,du=36495,fu=36283,pu=36284,Ha=36285,mu=36286;var aa=2300,oc=2301,Zl=2302,id=2303,sd=2400,rd=2401,od=2402;var ig=3200;var gu=0,sg=1,Cs="",Kn="srgb",la="srgb-linear",ca="linear",Rt="srgb";var Jl=7680;var rg=519,og=512,ag=513,lg=514,Dd=515,cg=516,ug=517,Nd=518,Ud=519,Od=35044;var Fd="300 es",Mi=2e3,io=2001;function Qx(n){for(let e=n.length-1;e>=0;--e)if(n[e]>=65535)return!0;return!1}function ev(n){return ArrayBuffer.isView(n)&&!(n instanceof DataView)}function ua(n){return document.createElementNS("http://www.w3.org/1999/xhtml",n)}function hg(){let n=ua("canvas");return n.style.display="block",n}var em={},so=null;function ha(...n){let e="THREE."+n.shift();so?so("log",e,...n):console.log(e,...n)}function dg(n){let e=n[0];if(typeof e=="string"&&e.startsWith("TSL:")){let t=n[1];t&&t.isStackTrace?n[0]+=" "+t.getLocation():n[1]='Stack trace not available. Enable "THREE.Node.captureStackTrace" to capture stack traces.'}return n}function $e(...n){n=dg(n);let e="THREE."+n.shift();if(so)so("warn",e,...n);else{let t=n[0];t&&t.isStackTrace?console.warn(t.getError(e)):console.warn(e,...n)}}function Qe(...n){n=dg(n);let e="THREE."+n.shift();if(so)so("error",e,...n);else{let t=n[0];t&&t.isStackTrace?console.error(t.getError(e)):console.error(e,...n)}}function ra(...n){let e=n.join(" ");e in em||(em[e]=!0,$e(...n))}function fg(n,e,t){return new Promise(function(i,s){function r(){switch(n.clientWaitSync(e,n.SYNC_FLUSH_COMMANDS_BIT,0)){case n.WAIT_FAILED:s();break;case n.TIMEOUT_EXPIRED:setTimeout(r,t);break;default:i()}}setTimeout(r,t)})}var pg={[Kl]:Kl,[Ql]:nc,[ec]:ec,[no]:tc,[jl]:jl,[nc]:Ql,[ic]:ic,[tc]:no},Ui=class{addEventListener(e,t){this._listeners===void 0&&(this._listeners={});let i=this._listeners;i[e]===void 0&&(i[e]=[]),i[e].indexOf(t)===-1&&i[e].push(t)}hasEventListener(e,t){let i=this._listeners;return i===void 0?!1:i[e]!==void 0&&i[e].indexOf(t)!==-1}removeEventListener(e,t){let i=this._listeners;if(i===void 0)return;let s=i[e];if(s!==void 0){let r=s.indexOf(t);r!==-1&&s.splice(r,1)}}dispatchEvent(e){let t=this._listeners;if(t===void 0)return;let i=t[e.type];if(i!==void 0){e.target=this;let s=i.slice(0);for(let r=0,o=s.length;r<o;r++)s[r].call(this,e);e.target=null}}},Gn=["00","01","02","03","04","05","06","07","08","09","0a","0b","0c","0d","0e","0f","10","11","12","13","14","15","16","17","18","19","1a","1b","1c","1d","1e","1f","20","21","22","23","24","25","26","27","28","29","2a","2b","2c","2d","2e","2f","30","31","32","33","34","35","36","37","38","39","3a","3b","3c","3d","3e","3f","40","41","42","43","44","45","46","47","48","49","4a","4b","4c","4d","4e","4f","50","51","52","53","54","55","56","57","58","59","5a","5b","5c","5d","5e","5f","60","61","62","63","64","65","66","67","68","69","6a","6b","6c","6d","6e","6f","70","71","72","73","74","75","76","77","78","79","7a","7b","7c","7d","7e","7f","80","81","82","83","84","85","86","87","88","89","8a","8b","8c","8d","8e","8f","90","91","92","93","94","95","96","97","98","99","9a","9b","9c","9d","9e","9f","a0","a1","a2","a3","a4","a5","a6","a7","a8","a9","aa","ab","ac","ad","ae","af","b0","b1","b2","b3","b4","b5","b6","b7","b8","b9","ba","bb","bc","bd","be","bf","c0","c1","c2","c3","c4","c5","c6","c7","c8","c9","ca","cb","cc","cd","ce","cf","d0","d1","d2","d3","d4","d5","d6","d7","d8","d9","da","db","dc","dd","de","df","e0","e1","e2","e3","e4","e5","e6","e7","e8","e9","ea","eb","ec","ed","ee","ef","f0","f1","f2","f3","f4","f5","f6","f7","f8","f9","fa","fb","fc","fd","fe","ff"],tm=1234567,eo=Math.PI/180,ro=180/Math.PI;function tr(){let n=Math.random()*4294967295|0,e=Math.random()*4294967295|0,t=Math.random()*4294967295|0,i=Math.random()*4294967295|0;return(Gn[n&255]+Gn[n>>8&255]+Gn[n>>16&255]+Gn[n>>24&255]+"-"+Gn[e&255]+Gn[e>>8&255]+"-"+Gn[e>>16&15|64]+Gn[e>>24&255]+"-"+Gn[t&63|128]+Gn[t>>8&255]+"-"+Gn[t>>16&255]+Gn[t>>24&255]+Gn[i&255]+Gn[i>>8&255]+Gn[i>>16&255]+Gn[i>>24&255]).toLowerCase()}function mt(n,e,t){return Math.max(e,Math.min(t,n))}function kd(n,e){return(n%e+e)%e}function tv(n,e,t,i,s){return i+(n-e)*(s-i)/(t-e)}function nv(n,e,t){return n!==e?(t-n)/(e-n):0}function oa(n,e,t){return(1-t)*n+t*e}function iv(n,e,t,i){return oa(n,e,1-Math.exp(-t*i))}function sv(n,e=1){return e-Math.abs(kd(n,e*2)-e)}function rv(n,e,t){return n<=e?0:n>=t?1:(n=(n-e)/(t-e),n*n*(3-2*n))}function ov(n,e,t){return n<=e?0:n>=t?1:(n=(n-e)/(t-e),n*n*n*(n*(n*6-15)+10))}function av(n,e){return n+Math.floor(Math.random()*(e-n+1))}function lv(n,e){return n+Math.random()*(e-n)}function cv(n){return n*(.5-Math.random())}function uv(n){n!==void 0&&(tm=n);let e=tm+=1831565813;return e=Math.imul(e^e>>>15,e|1),e^=e+Math.imul(e^e>>>7,e|61),((e^e>>>14)>>>0)/4294967296}function hv(n){return n*eo}function dv(n){return n*ro}function fv(n){return n>0&&Number.isInteger(n)&&2**Math.round(Math.log2(n))===n}function pv(n){return Math.pow(2,Math.ceil(Math.log(n)/Math.LN2))}function Bd(n){return Math.pow(2,Math.floor(Math.log(n)/Math.LN2))}function mv(n,e,t,i,s){let r=Math.cos,o=Math.sin,a=r(t/2),l=o(t/2),c=r((e+i)/2),u=o((e+i)/2),d=r((e-i)/2),h=o((e-i)/2),f=r((i-e)/2),m=o((i-e)/2);switch(s){case"XYX":n.set(a*u,l*d,l*h,a*c);break;case"YZY":n.set(l*h,a*u,l*d,a*c);break;case"ZXZ":n.set(l*d,l*h,a*u,a*c);break;case"XZX":n.set(a*u,l*m,l*f,a*c);break;case"YXY":n.set(l*f,a*u,l*m,a*c);break;case"ZYZ":n.set(l*m,l*f,a*u,a*c);break;default:$e("MathUtils: .setQuaternionFromProperEuler() encountered an unknown order: "+s)}}function _u(n){switch(n.constructor){case Uint32Array:return 4294967295;case Uint16Array:return 65535;case Uint8Array:case Uint8ClampedArray:return 255;case Int32Array:return 2147483647;case Int16Array:return 32767;case Int8Array:return 127;default:return}}function zd(n,e){if(e.constructor===Float32Array)return n;let t=_u(e);if(t===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.max(n/t,-1)}function Vd(n,e){if(e.constructor===Float32Array)return n;let t=_u(e);if(t===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.round(n*t)}var Gd={DEG2RAD:eo,RAD2DEG:ro,generateUUID:tr,clamp:mt,euclideanModulo:kd,mapLinear:tv,inverseLerp:nv,lerp:oa,damp:iv,pingpong:sv,smoothstep:rv,smootherstep:ov,randInt:av,randFloat:lv,randFloatSpread:cv,seededRandom:uv,degToRad:hv,radToDeg:dv,isPowerOfTwo:fv,ceilPowerOfTwo:pv,floorPowerOfTwo:Bd,setQuaternionFromProperEuler:mv,normalize:Vd,denormalize:zd},qe=class{static{this.prototype.isVector2=!0}constructor(e=0,t=0){this.x=e,this.y=t}get width(){return this.x}set width(e){this.x=e}get height(){return this.y}set height(e){this.y=e}set(e,t){return this.x=e,this.y=t,this}setScalar(e){return this.x=e,this.y=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;default:throw new Error("THREE.Vector2: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;default:throw new Error("THREE.Vector2: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y)}copy(e){return this.x=e.x,this.y=e.y,this}add(e){return this.x+=e.x,this.y+=e.y,this}addScalar(e){return this.x+=e,this.y+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this}subScalar(e){return this.x-=e,this.y-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this}multiply(e){return this.x*=e.x,this.y*=e.y,this}multiplyScalar(e){return this.x*=e,this.y*=e,this}divide(e){return this.x/=e.x,this.y/=e.y,this}divideScalar(e){return this.multiplyScalar(1/e)}applyMatrix3(e){let t=this.x,i=this.y,s=e.elements;return this.x=s[0]*t+s[3]*i+s[6],this.y=s[1]*t+s[4]*i+s[7],this}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this}clamp(e,t){return this.x=mt(this.x,e.x,t.x),this.y=mt(this.y,e.y,t.y),this}clampScalar(e,t){return this.x=mt(this.x,e,t),this.y=mt(this.y,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(mt(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this}negate(){return this.x=-this.x,this.y=-this.y,this}dot(e){return this.x*e.x+this.y*e.y}cross(e){return this.x*e.y-this.y*e.x}lengthSq(){return this.x*this.x+this.y*this.y}length(){return Math.sqrt(this.x*this.x+this.y*this.y)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)}normalize(){return this.divideScalar(this.length()||1)}angle(){return Math.atan2(-this.y,-this.x)+Math.PI}angleTo(e){let t=Math.sqrt(this.lengthSq()*e.lengthSq());if(t===0)return Math.PI/2;let i=this.dot(e)/t;return Math.acos(mt(i,-1,1))}distanceTo(e){return Math.sqrt(this.distanceToSquared(e))}distanceToSquared(e){let t=this.x-e.x,i=this.y-e.y;return t*t+i*i}manhattanDistanceTo(e){return Math.abs(this.x-e.x)+Math.abs(this.y-e.y)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this}equals(e){return e.x===this.x&&e.y===this.y}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this}rotateAround(e,t){let i=Math.cos(t),s=Math.sin(t),r=this.x-e.x,o=this.y-e.y;return this.x=r*i-o*s+e.x,this.y=r*s+o*i+e.y,this}random(){return this.x=Math.random(),this.y=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y}},Un=class{constructor(e=0,t=0,i=0,s=1){this.isQuaternion=!0,this._x=e,this._y=t,this._z=i,this._w=s}static slerpFlat(e,t,i,s,r,o,a){let l=i[s+0],c=i[s+1],u=i[s+2],d=i[s+3],h=r[o+0],f=r[o+1],m=r[o+2],y=r[o+3];if(d!==y||l!==h||c!==f||u!==m){let g=l*h+c*f+u*m+d*y;g<0&&(h=-h,f=-f,m=-m,y=-y,g=-g);let _=1-a;if(g<.9995){let b=Math.acos(g),C=Math.sin(b);_=Math.sin(_*b)/C,a=Math.sin(a*b)/C,l=l*_+h*a,c=c*_+f*a,u=u*_+m*a,d=d*_+y*a}else{l=l*_+h*a,c=c*_+f*a,u=u*_+m*a,d=d*_+y*a;let b=1/Math.sqrt(l*l+c*c+u*u+d*d);l*=b,c*=b,u*=b,d*=b}}e[t]=l,e[t+1]=c,e[t+2]=u,e[t+3]=d}static multiplyQuaternionsFlat(e,t,i,s,r,o){let a=i[s],l=i[s+1],c=i[s+2],u=i[s+3],d=r[o],h=r[o+1],f=r[o+2],m=r[o+3];return e[t]=a*m+u*d+l*f-c*h,e[t+1]=l*m+u*h+c*d-a*f,e[t+2]=c*m+u*f+a*h-l*d,e[t+3]=u*m-a*d-l*h-c*f,e}get x(){return this._x}set x(e){this._x=e,this._onChangeCallback()}get y(){return this._y}set y(e){this._y=e,this._onChangeCallback()}get z(){return this._z}set z(e){this._z=e,this._onChangeCallback()}get w(){return this._w}set w(e){this._w=e,this._onChangeCallback()}set(e,t,i,s){return this._x=e,this._y=t,this._z=i,this._w=s,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._w)}copy(e){return this._x=e.x,this._y=e.y,this._z=e.z,this._w=e.w,this._onChangeCallback(),this}setFromEuler(e,t=!0){let i=e._x,s=e._y,r=e._z,o=e._order,a=Math.cos,l=Math.sin,c=a(i/2),u=a(s/2),d=a(r/2),h=l(i/2),f=l(s/2),m=l(r/2);switch(o){case"XYZ":this._x=h*u*d+c*f*m,this._y=c*f*d-h*u*m,this._z=c*u*m+h*f*d,this._w=c*u*d-h*f*m;break;case"YXZ":this._x=h*u*d+c*f*m,this._y=c*f*d-h*u*m,this._z=c*u*m-h*f*d,this._w=c*u*d+h*f*m;break;case"ZXY":this._x=h*u*d-c*f*m,this._y=c*f*d+h*u*m,this._z=c*u*m+h*f*d,this._w=c*u*d-h*f*m;break;case"ZYX":this._x=h*u*d-c*f*m,this._y=c*f*d+h*u*m,this._z=c*u*m-h*f*d,this._w=c*u*d+h*f*m;break;case"YZX":this._x=h*u*d+c*f*m,this._y=c*f*d+h*u*m,this._z=c*u*m-h*f*d,this._w=c*u*d-h*f*m;break;case"XZY":this._x=h*u*d-c*f*m,this._y=c*f*d-h*u*m,this._z=c*u*m+h*f*d,this._w=c*u*d+h*f*m;break;default:$e("Quaternion: .setFromEuler() encountered an unknown order: "+o)}return t===!0&&this._onChangeCallback(),this}setFromAxisAngle(e,t){let i=t/2,s=Math.sin(i);return this._x=e.x*s,this._y=e.y*s,this._z=e.z*s,this._w=Math.cos(i),this._onChangeCallback(),this}setFromRotationMatrix(e){let t=e.elements,i=t[0],s=t[4],r=t[8],o=t[1],a=t[5],l=t[9],c=t[2],u=t[6],d=t[10],h=i+a+d;if(h>0){let f=.5/Math.sqrt(h+1);this._w=.25/f,this._x=(u-l)*f,this._y=(r-c)*f,this._z=(o-s)*f}else if(i>a&&i>d){let f=2*Math.sqrt(1+i-a-d);this._w=(u-l)/f,this._x=.25*f,this._y=(s+o)/f,this._z=(r+c)/f}else if(a>d){let f=2*Math.sqrt(1+a-i-d);this._w=(r-c)/f,this._x=(s+o)/f,this._y=.25*f,this._z=(l+u)/f}else{let f=2*Math.sqrt(1+d-i-a);this._w=(o-s)/f,this._x=(r+c)/f,this._y=(l+u)/f,this._z=.25*f}return this._onChangeCallback(),this}setFromUnitVectors(e,t){let i=e.dot(t)+1;return i<1e-8?(i=0,Math.abs(e.x)>Math.abs(e.z)?(this._x=-e.y,this._y=e.x,this._z=0,this._w=i):(this._x=0,this._y=-e.z,this._z=e.y,this._w=i)):(this._x=e.y*t.z-e.z*t.y,this._y=e.z*t.x-e.x*t.z,this._z=e.x*t.y-e.y*t.x,this._w=i),this.normalize()}angleTo(e){return 2*Math.acos(Math.abs(mt(this.dot(e),-1,1)))}rotateTowards(e,t){let i=this.angleTo(e);if(i===0)return this;let s=Math.min(1,t/i);return this.slerp(e,s),this}identity(){return this.set(0,0,0,1)}invert(){return this.conjugate()}conjugate(){return this._x*=-1,this._y*=-1,this._z*=-1,this._onChangeCallback(),this}dot(e){return this._x*e._x+this._y*e._y+this._z*e._z+this._w*e._w}lengthSq(){return this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w}length(){return Math.sqrt(this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w)}normalize(){let e=this.length();return e===0?(this._x=0,this._y=0,this._z=0,this._w=1):(e=1/e,this._x=this._x*e,this._y=this._y*e,this._z=this._z*e,this._w=this._w*e),this._onChangeCallback(),this}multiply(e){return this.multiplyQuaternions(this,e)}premultiply(e){return this.multiplyQuaternions(e,this)}multiplyQuaternions(e,t){let i=e._x,s=e._y,r=e._z,o=e._w,a=t._x,l=t._y,c=t._z,u=t._w;return this._x=i*u+o*a+s*c-r*l,this._y=s*u+o*l+r*a-i*c,this._z=r*u+o*c+i*l-s*a,this._w=o*u-i*a-s*l-r*c,this._onChangeCallback(),this}slerp(e,t){let i=e._x,s=e._y,r=e._z,o=e._w,a=this.dot(e);a<0&&(i=-i,s=-s,r=-r,o=-o,a=-a);let l=1-t;if(a<.9995){let c=Math.acos(a),u=Math.sin(c);l=Math.sin(l*c)/u,t=Math.sin(t*c)/u,this._x=this._x*l+i*t,this._y=this._y*l+s*t,this._z=this._z*l+r*t,this._w=this._w*l+o*t,this._onChangeCallback()}else this._x=this._x*l+i*t,this._y=this._y*l+s*t,this._z=this._z*l+r*t,this._w=this._w*l+o*t,this.normalize();return this}slerpQuaternions(e,t,i){return this.copy(e).slerp(t,i)}random(){let e=2*Math.PI*Math.random(),t=2*Math.PI*Math.random(),i=Math.random(),s=Math.sqrt(1-i),r=Math.sqrt(i);return this.set(s*Math.sin(e),s*Math.cos(e),r*Math.sin(t),r*Math.cos(t))}equals(e){return e._x===this._x&&e._y===this._y&&e._z===this._z&&e._w===this._w}fromArray(e,t=0){return this._x=e[t],this._y=e[t+1],this._z=e[t+2],this._w=e[t+3],this._onChangeCallback(),this}toArray(e=[],t=0){return e[t]=this._x,e[t+1]=this._y,e[t+2]=this._z,e[t+3]=this._w,e}fromBufferAttribute(e,t){return this._x=e.getX(t),this._y=e.getY(t),this._z=e.getZ(t),this._w=e.getW(t),this._onChangeCallback(),this}toJSON(){return this.toArray()}_onChange(e){return this._onChangeCallback=e,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._w}},H=class{static{this.prototype.isVector3=!0}constructor(e=0,t=0,i=0){this.x=e,this.y=t,this.z=i}set(e,t,i){return i===void 0&&(i=this.z),this.x=e,this.y=t,this.z=i,this}setScalar(e){return this.x=e,this.y=e,this.z=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setZ(e){return this.z=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;case 2:this.z=t;break;default:throw new Error("THREE.Vector3: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;case 2:return this.z;default:throw new Error("THREE.Vector3: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y,this.z)}copy(e){return this.x=e.x,this.y=e.y,this.z=e.z,this}add(e){return this.x+=e.x,this.y+=e.y,this.z+=e.z,this}addScalar(e){return this.x+=e,this.y+=e,this.z+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this.z=e.z+t.z,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this.z+=e.z*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this.z-=e.z,this}subScalar(e){return this.x-=e,this.y-=e,this.z-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this.z=e.z-t.z,this}multiply(e){return this.x*=e.x,this.y*=e.y,this.z*=e.z,this}multiplyScalar(e){return this.x*=e,this.y*=e,this.z*=e,this}multiplyVectors(e,t){return this.x=e.x*t.x,this.y=e.y*t.y,this.z=e.z*t.z,this}applyEuler(e){return this.applyQuaternion(nm.setFromEuler(e))}applyAxisAngle(e,t){return this.applyQuaternion(nm.setFromAxisAngle(e,t))}applyMatrix3(e){let t=this.x,i=this.y,s=this.z,r=e.elements;return this.x=r[0]*t+r[3]*i+r[6]*s,this.y=r[1]*t+r[4]*i+r[7]*s,this.z=r[2]*t+r[5]*i+r[8]*s,this}applyNormalMatrix(e){return this.applyMatrix3(e).normalize()}applyMatrix4(e){let t=this.x,i=this.y,s=this.z,r=e.elements,o=1/(r[3]*t+r[7]*i+r[11]*s+r[15]);return this.x=(r[0]*t+r[4]*i+r[8]*s+r[12])*o,this.y=(r[1]*t+r[5]*i+r[9]*s+r[13])*o,this.z=(r[2]*t+r[6]*i+r[10]*s+r[14])*o,this}applyQuaternion(e){let t=this.x,i=this.y,s=this.z,r=e.x,o=e.y,a=e.z,l=e.w,c=2*(o*s-a*i),u=2*(a*t-r*s),d=2*(r*i-o*t);return this.x=t+l*c+o*d-a*u,this.y=i+l*u+a*c-r*d,this.z=s+l*d+r*u-o*c,this}project(e){return this.applyMatrix4(e.matrixWorldInverse).applyMatrix4(e.projectionMatrix)}unproject(e){return this.applyMatrix4(e.projectionMatrixInverse).applyMatrix4(e.matrixWorld)}transformDirection(e){let t=this.x,i=this.y,s=this.z,r=e.elements;return this.x=r[0]*t+r[4]*i+r[8]*s,this.y=r[1]*t+r[5]*i+r[9]*s,this.z=r[2]*t+r[6]*i+r[10]*s,this.normalize()}divide(e){return this.x/=e.x,this.y/=e.y,this.z/=e.z,this}divideScalar(e){return this.multiplyScalar(1/e)}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this.z=Math.min(this.z,e.z),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this.z=Math.max(this.z,e.z),this}clamp(e,t){return this.x=mt(this.x,e.x,t.x),this.y=mt(this.y,e.y,t.y),this.z=mt(this.z,e.z,t.z),this}clampScalar(e,t){return this.x=mt(this.x,e,t),this.y=mt(this.y,e,t),this.z=mt(this.z,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(mt(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this}dot(e){return this.x*e.x+this.y*e.y+this.z*e.z}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)}normalize(){return this.divideScalar(this.length()||1)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this.z+=(e.z-this.z)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this.z=e.z+(t.z-e.z)*i,this}cross(e){return this.crossVectors(this,e)}crossVectors(e,t){let i=e.x,s=e.y,r=e.z,o=t.x,a=t.y,l=t.z;return this.x=s*l-r*a,this.y=r*o-i*l,this.z=i*a-s*o,this}projectOnVector(e){let t=e.lengthSq();if(t===0)return this.set(0,0,0);let i=e.dot(this)/t;return this.copy(e).multiplyScalar(i)}projectOnPlane(e){return Nh.copy(this).projectOnVector(e),this.sub(Nh)}reflect(e){return this.sub(Nh.copy(e).multiplyScalar(2*this.dot(e)))}angleTo(e){let t=Math.sqrt(this.lengthSq()*e.lengthSq());if(t===0)return Math.PI/2;let i=this.dot(e)/t;return Math.acos(mt(i,-1,1))}distanceTo(e){return Math.sqrt(this.distanceToSquared(e))}distanceToSquared(e){let t=this.x-e.x,i=this.y-e.y,s=this.z-e.z;return t*t+i*i+s*s}manhattanDistanceTo(e){return Math.abs(this.x-e.x)+Math.abs(this.y-e.y)+Math.abs(this.z-e.z)}setFromSpherical(e){return this.setFromSphericalCoords(e.radius,e.phi,e.theta)}setFromSphericalCoords(e,t,i){let s=Math.sin(t)*e;return this.x=s*Math.sin(i),this.y=Math.cos(t)*e,this.z=s*Math.cos(i),this}setFromCylindrical(e){return this.setFromCylindricalCoords(e.radius,e.theta,e.y)}setFromCylindricalCoords(e,t,i){return this.x=e*Math.sin(t),this.y=i,this.z=e*Math.cos(t),this}setFromMatrixPosition(e){let t=e.elements;return this.x=t[12],this.y=t[13],this.z=t[14],this}setFromMatrixScale(e){let t=this.setFromMatrixColumn(e,0).length(),i=this.setFromMatrixColumn(e,1).length(),s=this.setFromMatrixColumn(e,2).length();return this.x=t,this.y=i,this.z=s,this}setFromMatrixColumn(e,t){return this.fromArray(e.elements,t*4)}setFromMatrix3Column(e,t){return this.fromArray(e.elements,t*3)}setFromEuler(e){return this.x=e._x,this.y=e._y,this.z=e._z,this}setFromColor(e){return this.x=e.r,this.y=e.g,this.z=e.b,this}equals(e){return e.x===this.x&&e.y===this.y&&e.z===this.z}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this.z=e[t+2],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e[t+2]=this.z,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this.z=e.getZ(t),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this}randomDirection(){let e=Math.random()*Math.PI*2,t=Math.random()*2-1,i=Math.sqrt(1-t*t);return this.x=i*Math.cos(e),this.y=t,this.z=i*Math.sin(e),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z}},Nh=new H,nm=new Un,nt=class{static{this.prototype.isMatrix3=!0}constructor(e,t,i,s,r,o,a,l,c){this.elements=[1,0,0,0,1,0,0,0,1],e!==void 0&&this.set(e,t,i,s,r,o,a,l,c)}set(e,t,i,s,r,o,a,l,c){let u=this.elements;return u[0]=e,u[1]=s,u[2]=a,u[3]=t,u[4]=r,u[5]=l,u[6]=i,u[7]=o,u[8]=c,this}identity(){return this.set(1,0,0,0,1,0,0,0,1),this}copy(e){let t=this.elements,i=e.elements;return t[0]=i[0],t[1]=i[1],t[2]=i[2],t[3]=i[3],t[4]=i[4],t[5]=i[5],t[6]=i[6],t[7]=i[7],t[8]=i[8],this}extractBasis(e,t,i){return e.setFromMatrix3Column(this,0),t.setFromMatrix3Column(this,1),i.setFromMatrix3Column(this,2),this}setFromMatrix4(e){let t=e.elements;return this.set(t[0],t[4],t[8],t[1],t[5],t[9],t[2],t[6],t[10]),this}multiply(e){return this.multiplyMatrices(this,e)}premultiply(e){return this.multiplyMatrices(e,this)}multiplyMatrices(e,t){let i=e.elements,s=t.elements,r=this.elements,o=i[0],a=i[3],l=i[6],c=i[1],u=i[4],d=i[7],h=i[2],f=i[5],m=i[8],y=s[0],g=s[3],_=s[6],b=s[1],C=s[4],S=s[7],P=s[2],A=s[5],x=s[8];return r[0]=o*y+a*b+l*P,r[3]=o*g+a*C+l*A,r[6]=o*_+a*S+l*x,r[1]=c*y+u*b+d*P,r[4]=c*g+u*C+d*A,r[7]=c*_+u*S+d*x,r[2]=h*y+f*b+m*P,r[5]=h*g+f*C+m*A,r[8]=h*_+f*S+m*x,this}multiplyScalar(e){let t=this.elements;return t[0]*=e,t[3]*=e,t[6]*=e,t[1]*=e,t[4]*=e,t[7]*=e,t[2]*=e,t[5]*=e,t[8]*=e,this}determinant(){let e=this.elements,t=e[0],i=e[1],s=e[2],r=e[3],o=e[4],a=e[5],l=e[6],c=e[7],u=e[8];return t*o*u-t*a*c-i*r*u+i*a*l+s*r*c-s*o*l}invert(){let e=this.elements,t=e[0],i=e[1],s=e[2],r=e[3],o=e[4],a=e[5],l=e[6],c=e[7],u=e[8],d=u*o-a*c,h=a*l-u*r,f=c*r-o*l,m=t*d+i*h+s*f;if(m===0)return this.set(0,0,0,0,0,0,0,0,0);let y=1/m;return e[0]=d*y,e[1]=(s*c-u*i)*y,e[2]=(a*i-s*o)*y,e[3]=h*y,e[4]=(u*t-s*l)*y,e[5]=(s*r-a*t)*y,e[6]=f*y,e[7]=(i*l-c*t)*y,e[8]=(o*t-i*r)*y,this}transpose(){let e,t=this.elements;return e=t[1],t[1]=t[3],t[3]=e,e=t[2],t[2]=t[6],t[6]=e,e=t[5],t[5]=t[7],t[7]=e,this}getNormalMatrix(e){return this.setFromMatrix4(e).invert().transpose()}transposeIntoArray(e){let t=this.elements;return e[0]=t[0],e[1]=t[3],e[2]=t[6],e[3]=t[1],e[4]=t[4],e[5]=t[7],e[6]=t[2],e[7]=t[5],e[8]=t[8],this}setUvTransform(e,t,i,s,r,o,a){let l=Math.cos(r),c=Math.sin(r);return this.set(i*l,i*c,-i*(l*o+c*a)+o+e,-s*c,s*l,-s*(-c*o+l*a)+a+t,0,0,1),this}scale(e,t){return ra("Matrix3: .scale() is deprecated. Use .makeScale() instead."),this.premultiply(Uh.makeScale(e,t)),this}rotate(e){return ra("Matrix3: .rotate() is deprecated. Use .makeRotation() instead."),this.premultiply(Uh.makeRotation(-e)),this}translate(e,t){return ra("Matrix3: .translate() is deprecated. Use .makeTranslation() instead."),this.premultiply(Uh.makeTranslation(e,t)),this}makeTranslation(e,t){return e.isVector2?this.set(1,0,e.x,0,1,e.y,0,0,1):this.set(1,0,e,0,1,t,0,0,1),this}makeRotation(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,-i,0,i,t,0,0,0,1),this}makeScale(e,t){return this.set(e,0,0,0,t,0,0,0,1),this}equals(e){let t=this.elements,i=e.elements;for(let s=0;s<9;s++)if(t[s]!==i[s])return!1;return!0}fromArray(e,t=0){for(let i=0;i<9;i++)this.elements[i]=e[i+t];return this}toArray(e=[],t=0){let i=this.elements;return e[t]=i[0],e[t+1]=i[1],e[t+2]=i[2],e[t+3]=i[3],e[t+4]=i[4],e[t+5]=i[5],e[t+6]=i[6],e[t+7]=i[7],e[t+8]=i[8],e}clone(){return new this.constructor().fromArray(this.elements)}},Uh=new nt,im=new nt().set(.4123908,.3575843,.1804808,.212639,.7151687,.0721923,.0193308,.1191948,.9505322),sm=new nt().set(3.2409699,-1.5373832,-.4986108,-.9692436,1.8759675,.0415551,.0556301,-.203977,1.0569715);function gv(){let n={enabled:!0,workingColorSpace:la,spaces:{},convert:function(s,r,o){return this.enabled===!1||r===o||!r||!o||(this.spaces[r].transfer===Rt&&(s.r=bs(s.r),s.g=bs(s.g),s.b=bs(s.b)),this.spaces[r].primaries!==this.spaces[o].primaries&&(s.applyMatrix3(this.spaces[r].toXYZ),s.applyMatrix3(this.spaces[o].fromXYZ)),this.spaces[o].transfer===Rt&&(s.r=to(s.r),s.g=to(s.g),s.b=to(s.b))),s},workingToColorSpace:function(s,r){return this.convert(s,this.workingColorSpace,r)},colorSpaceToWorking:function(s,r){return this.convert(s,r,this.workingColorSpace)},getPrimaries:function(s){return this.spaces[s].primaries},getTransfer:function(s){return s===Cs?ca:this.spaces[s].transfer},getToneMappingMode:function(s){return this.spaces[s].outputColorSpaceConfig.toneMappingMode||"standard"},getLuminanceCoefficients:function(s,r=this.workingColorSpace){return s.fromArray(this.spaces[r].luminanceCoefficients)},define:function(s){Object.assign(this.spaces,s)},_getMatrix:function(s,r,o){return s.copy(this.spaces[o].fromXYZ).multiply(this.spaces[r].toXYZ)},_getDrawingBufferColorSpace:function(s){return this.spaces[s].outputColorSpaceConfig.drawingBufferColorSpace},_getUnpackColorSpace:function(s=this.workingColorSpace){return this.spaces[s].workingColorSpaceConfig.unpackColorSpace}},e=[.64,.33,.3,.6,.15,.06],t=[.2126,.7152,.0722],i=[.3127,.329];return n.define({[la]:{primaries:e,whitePoint:i,transfer:ca,toXYZ:im,fromXYZ:sm,luminanceCoefficients:t,workingColorSpaceConfig:{unpackColorSpace:Kn},outputColorSpaceConfig:{drawingBufferColorSpace:Kn}},[Kn]:{primaries:e,whitePoint:i,transfer:Rt,toXYZ:im,fromXYZ:sm,luminanceCoefficients:t,outputColorSpaceConfig:{drawingBufferColorSpace:Kn}}}),n}var yt=gv();function bs(n){return n<.04045?n*.0773993808:Math.pow(n*.9478672986+.0521327014,2.4)}function to(n){return n<.0031308?n*12.92:1.055*Math.pow(n,.41666)-.055}var Fr,ac=class{static getDataURL(e,t="image/png"){if(/^data:/i.test(e.src)||typeof HTMLCanvasElement>"u")return e.src;let i;if(e instanceof HTMLCanvasElement)i=e;else{Fr===void 0&&(Fr=ua("canvas")),Fr.width=e.width,Fr.height=e.height;let s=Fr.getContext("2d");e instanceof ImageData?s.putImageData(e,0,0):s.drawImage(e,0,0,e.width,e.height),i=Fr}return i.toDataURL(t)}static sRGBToLinear(e){if(typeof HTMLImageElement<"u"&&e instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&e instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&e instanceof ImageBitmap){let t=ua("canvas");t.width=e.width,t.height=e.height;let i=t.getContext("2d");i.drawImage(e,0,0,e.width,e.height);let s=i.getImageData(0,0,e.width,e.height),r=s.data;for(let o=0;o<r.length;o++)r[o]=bs(r[o]/255)*255;return i.putImageData(s,0,0),t}else if(e.data){let t=e.data.slice(0);for(let i=0;i<t.length;i++)t instanceof Uint8Array||t instanceof Uint8ClampedArray?t[i]=Math.floor(bs(t[i]/255)*255):t[i]=bs(t[i]);return{data:t,width:e.width,height:e.height}}else return $e("ImageUtils.sRGBToLinear(): Unsupported image type. No color space conversion applied."),e}},_v=0,oo=class{constructor(e=null){this.isTextureSource=!0,Object.defineProperty(this,"id",{value:_v++}),this.uuid=tr(),this.data=e,this.dataReady=!0,this.version=0}getSize(e){let t=this.data;return typeof HTMLVideoElement<"u"&&t instanceof HTMLVideoElement?e.set(t.videoWidth,t.videoHeight,0):typeof VideoFrame<"u"&&t instanceof VideoFrame?e.set(t.displayWidth,t.displayHeight,0):t!==null?e.set(t.width||0,t.height||0,t.depth||0):e.set(0,0,0),e}set needsUpdate(e){e===!0&&this.version++}toJSON(e){let t=e===void 0||typeof e=="string";if(!t&&e.images[this.uuid]!==void 0)return e.images[this.uuid];let i={uuid:this.uuid,url:""},s=this.data;if(s!==null){let r;if(Array.isArray(s)){r=[];for(let o=0,a=s.length;o<a;o++)s[o].isDataTexture?r.push(Oh(s[o].image)):r.push(Oh(s[o]))}else r=Oh(s);i.url=r}return t||(e.images[this.uuid]=i),i}};function Oh(n){return typeof HTMLImageElement<"u"&&n instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&n instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&n instanceof ImageBitmap?ac.getDataURL(n):n.data?{data:Array.from(n.data),width:n.width,height:n.height,type:n.data.constructor.name}:($e("Texture: Unable to serialize Texture."),{})}var xv=0,Fh=new H,ei=class n extends Ui{constructor(e=n.DEFAULT_IMAGE,t=n.DEFAULT_MAPPING,i=Qi,s=Qi,r=Qn,o=Es,a=zi,l=oi,c=n.DEFAULT_ANISOTROPY,u=Cs){super(),this.isTexture=!0,Object.defineProperty(this,"id",{value:xv++}),this.uuid=tr(),this.name="",this.source=new oo(e),this.mipmaps=[],this.mapping=t,this.channel=0,this.wrapS=i,this.wrapT=s,this.magFilter=r,this.minFilter=o,this.anisotropy=c,this.format=a,this.internalFormat=null,this.type=l,this.offset=new qe(0,0),this.repeat=new qe(1,1),this.center=new qe(0,0),this.rotation=0,this.matrixAutoUpdate=!0,this.matrix=new nt,this.generateMipmaps=!0,this.mipmapsAutoUpdate=!0,this.premultiplyAlpha=!1,this.flipY=!0,this.unpackAlignment=4,this.colorSpace=u,this.userData={},this.updateRanges=[],this.version=0,this.onUpdate=null,this.renderTarget=null,this.isRenderTargetTexture=!1,this.isArrayTexture=!!(e&&e.depth&&e.depth>1),this.pmremVersion=0,this.isPMREMTexture=!1,this.normalized=!1}get width(){return this.source.getSize(Fh).x}get height(){return this.source.getSize(Fh).y}get depth(){return this.source.getSize(Fh).z}get image(){return this.source.data}set image(e){this.source.data=e}updateMatrix(){this.matrix.setUvTransform(this.offset.x,this.offset.y,this.repeat.x,this.repeat.y,this.rotation,this.center.x,this.center.y)}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}clone(){return new this.constructor().copy(this)}copy(e){return this.name=e.name,this.source=e.source,this.mipmaps=e.mipmaps.slice(0),this.mapping=e.mapping,this.channel=e.channel,this.wrapS=e.wrapS,this.wrapT=e.wrapT,this.magFilter=e.magFilter,this.minFilter=e.minFilter,this.anisotropy=e.anisotropy,this.format=e.format,this.internalFormat=e.internalFormat,this.type=e.type,this.normalized=e.normalized,this.offset.copy(e.offset),this.repeat.copy(e.repeat),this.center.copy(e.center),this.rotation=e.rotation,this.matrixAutoUpdate=e.matrixAutoUpdate,this.matrix.copy(e.matrix),this.generateMipmaps=e.generateMipmaps,this.mipmapsAutoUpdate=e.mipmapsAutoUpdate,this.premultiplyAlpha=e.premultiplyAlpha,this.flipY=e.flipY,this.unpackAlignment=e.unpackAlignment,this.colorSpace=e.colorSpace,this.renderTarget=e.renderTarget,this.isRenderTargetTexture=e.isRenderTargetTexture,this.isPMREMTexture=e.isPMREMTexture,this.isArrayTexture=e.isArrayTexture,this.userData=JSON.parse(JSON.stringify(e.userData)),this.needsUpdate=!0,this}setValues(e){for(let t in e){let i=e[t];if(i===void 0){$e(`Texture.setValues(): parameter '${t}' has value of undefined.`);continue}let s=this[t];if(s===void 0){$e(`Texture.setValues(): property '${t}' does not exist.`);continue}s&&i&&s.isVector2&&i.isVector2||s&&i&&s.isVector3&&i.isVector3||s&&i&&s.isMatrix3&&i.isMatrix3?s.copy(i):this[t]=i}}toJSON(e){let t=e===void 0||typeof e=="string";if(!t&&e.textures[this.uuid]!==void 0)return e.textures[this.uuid];let i={metadata:{version:4.7,type:"Texture",generator:"Texture.toJSON"},uuid:this.uuid,name:this.name,image:this.source.toJSON(e).uuid,mapping:this.mapping,channel:this.channel,repeat:[this.repeat.x,this.repeat.y],offset:[this.offset.x,this.offset.y],center:[this.center.x,this.center.y],rotation:this.rotation,wrap:[this.wrapS,this.wrapT],format:this.format,internalFormat:this.internalFormat,type:this.type,normalized:this.normalized,colorSpace:this.colorSpace,minFilter:this.minFilter,magFilter:this.magFilter,anisotropy:this.anisotropy,flipY:this.flipY,generateMipmaps:this.generateMipmaps,mipmapsAutoUpdate:this.mipmapsAutoUpdate,premultiplyAlpha:this.premultiplyAlpha,unpackAlignment:this.unpackAlignment};return Object.keys(this.userData).length>0&&(i.userData=this.userData),t||(e.textures[this.uuid]=i),i}dispose(){this.dispatchEvent({type:"dispose"})}transformUv(e){if(this.mapping!==Td)return e;if(e.applyMatrix3(this.matrix),e.x<0||e.x>1)switch(this.wrapS){case sc:e.x=e.x-Math.floor(e.x);break;case Qi:e.x=e.x<0?0:1;break;case rc:Math.abs(Math.floor(e.x)%2)===1?e.x=Math.ceil(e.x)-e.x:e.x=e.x-Math.floor(e.x);break}if(e.y<0||e.y>1)switch(this.wrapT){case sc:e.y=e.y-Math.floor(e.y);break;case Qi:e.y=e.y<0?0:1;break;case rc:Math.abs(Math.floor(e.y)%2)===1?e.y=Math.ceil(e.y)-e.y:e.y=e.y-Math.floor(e.y);break}return this.flipY&&(e.y=1-e.y),e}set needsUpdate(e){e===!0&&(this.version++,this.source.needsUpdate=!0)}set needsPMREMUpdate(e){e===!0&&this.pmremVersion++}};ei.DEFAULT_IMAGE=null;ei.DEFAULT_MAPPING=Td;ei.DEFAULT_ANISOTROPY=1;var jt=class{static{this.prototype.isVector4=!0}constructor(e=0,t=0,i=0,s=1){this.x=e,this.y=t,this.z=i,this.w=s}get width(){return this.z}set width(e){this.z=e}get height(){return this.w}set height(e){this.w=e}set(e,t,i,s){return this.x=e,this.y=t,this.z=i,this.w=s,this}setScalar(e){return this.x=e,this.y=e,this.z=e,this.w=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setZ(e){return this.z=e,this}setW(e){return this.w=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;case 2:this.z=t;break;case 3:this.w=t;break;default:throw new Error("THREE.Vector4: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;case 2:return this.z;case 3:return this.w;default:throw new Error("THREE.Vector4: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y,this.z,this.w)}copy(e){return this.x=e.x,this.y=e.y,this.z=e.z,this.w=e.w!==void 0?e.w:1,this}add(e){return this.x+=e.x,this.y+=e.y,this.z+=e.z,this.w+=e.w,this}addScalar(e){return this.x+=e,this.y+=e,this.z+=e,this.w+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this.z=e.z+t.z,this.w=e.w+t.w,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this.z+=e.z*t,this.w+=e.w*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this.z-=e.z,this.w-=e.w,this}subScalar(e){return this.x-=e,this.y-=e,this.z-=e,this.w-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this.z=e.z-t.z,this.w=e.w-t.w,this}multiply(e){return this.x*=e.x,this.y*=e.y,this.z*=e.z,this.w*=e.w,this}multiplyScalar(e){return this.x*=e,this.y*=e,this.z*=e,this.w*=e,this}applyMatrix4(e){let t=this.x,i=this.y,s=this.z,r=this.w,o=e.elements;return this.x=o[0]*t+o[4]*i+o[8]*s+o[12]*r,this.y=o[1]*t+o[5]*i+o[9]*s+o[13]*r,this.z=o[2]*t+o[6]*i+o[10]*s+o[14]*r,this.w=o[3]*t+o[7]*i+o[11]*s+o[15]*r,this}divide(e){return this.x/=e.x,this.y/=e.y,this.z/=e.z,this.w/=e.w,this}divideScalar(e){return this.multiplyScalar(1/e)}setAxisAngleFromQuaternion(e){this.w=2*Math.acos(e.w);let t=Math.sqrt(1-e.w*e.w);return t<1e-4?(this.x=1,this.y=0,this.z=0):(this.x=e.x/t,this.y=e.y/t,this.z=e.z/t),this}setAxisAngleFromRotationMatrix(e){let t,i,s,r,l=e.elements,c=l[0],u=l[4],d=l[8],h=l[1],f=l[5],m=l[9],y=l[2],g=l[6],_=l[10];if(Math.abs(u-h)<.01&&Math.abs(d-y)<.01&&Math.abs(m-g)<.01){if(Math.abs(u+h)<.1&&Math.abs(d+y)<.1&&Math.abs(m+g)<.1&&Math.abs(c+f+_-3)<.1)return this.set(1,0,0,0),this;t=Math.PI;let C=(c+1)/2,S=(f+1)/2,P=(_+1)/2,A=(u+h)/4,x=(d+y)/4,w=(m+g)/4;return C>S&&C>P?C<.01?(i=0,s=.707106781,r=.707106781):(i=Math.sqrt(C),s=A/i,r=x/i):S>P?S<.01?(i=.707106781,s=0,r=.707106781):(s=Math.sqrt(S),i=A/s,r=w/s):P<.01?(i=.707106781,s=.707106781,r=0):(r=Math.sqrt(P),i=x/r,s=w/r),this.set(i,s,r,t),this}let b=Math.sqrt((g-m)*(g-m)+(d-y)*(d-y)+(h-u)*(h-u));return Math.abs(b)<.001&&(b=1),this.x=(g-m)/b,this.y=(d-y)/b,this.z=(h-u)/b,this.w=Math.acos((c+f+_-1)/2),this}setFromMatrixPosition(e){let t=e.elements;return this.x=t[12],this.y=t[13],this.z=t[14],this.w=t[15],this}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this.z=Math.min(this.z,e.z),this.w=Math.min(this.w,e.w),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this.z=Math.max(this.z,e.z),this.w=Math.max(this.w,e.w),this}clamp(e,t){return this.x=mt(this.x,e.x,t.x),this.y=mt(this.y,e.y,t.y),this.z=mt(this.z,e.z,t.z),this.w=mt(this.w,e.w,t.w),this}clampScalar(e,t){return this.x=mt(this.x,e,t),this.y=mt(this.y,e,t),this.z=mt(this.z,e,t),this.w=mt(this.w,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(mt(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this.w=Math.floor(this.w),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this.w=Math.ceil(this.w),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this.w=Math.round(this.w),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this.w=Math.trunc(this.w),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this.w=-this.w,this}dot(e){return this.x*e.x+this.y*e.y+this.z*e.z+this.w*e.w}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)+Math.abs(this.w)}normalize(){return this.divideScalar(this.length()||1)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this.z+=(e.z-this.z)*t,this.w+=(e.w-this.w)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this.z=e.z+(t.z-e.z)*i,this.w=e.w+(t.w-e.w)*i,this}equals(e){return e.x===this.x&&e.y===this.y&&e.z===this.z&&e.w===this.w}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this.z=e[t+2],this.w=e[t+3],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e[t+2]=this.z,e[t+3]=this.w,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this.z=e.getZ(t),this.w=e.getW(t),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this.w=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z,yield this.w}},lc=class extends Ui{constructor(e=1,t=1,i={}){super(),i=Object.assign({generateMipmaps:!1,internalFormat:null,minFilter:Qn,depthBuffer:!0,stencilBuffer:!1,resolveColorBuffer:!0,resolveDepthBuffer:!0,resolveStencilBuffer:!0,storeMultisampledColorBuffer:!0,storeMultisampledDepthBuffer:!0,storeMultisampledStencilBuffer:!0,depthTexture:null,samples:0,count:1,depth:1,multiview:!1,useArrayDepthTexture:!1},i),this.isRenderTarget=!0,this.width=e,this.height=t,this.depth=i.depth,this.scissor=new jt(0,0,e,t),this.scissorTest=!1,this.viewport=new jt(0,0,e,t),this.textures=[];let s=i.count;for(let r=0;r<s;r++)this.textures[r]=new ei({width:e,height:t,depth:i.depth}),this.textures[r].isRenderTargetTexture=!0,this.textures[r].renderTarget=this;this._setTextureOptions(i),this.depthBuffer=i.depthBuffer,this.stencilBuffer=i.stencilBuffer,this.resolveColorBuffer=i.resolveColorBuffer,this.resolveDepthBuffer=i.resolveDepthBuffer,this.resolveStencilBuffer=i.resolveStencilBuffer,this.storeMultisampledColorBuffer=i.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=i.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=i.storeMultisampledStencilBuffer,this._depthTexture=null,this.depthTexture=i.depthTexture,this.samples=i.samples,this.multiview=i.multiview,this.useArrayDepthTexture=i.useArrayDepthTexture}_setTextureOptions(e={}){let t={minFilter:Qn,generateMipmaps:!1,flipY:!1,internalFormat:null};e.mapping!==void 0&&(t.mapping=e.mapping),e.wrapS!==void 0&&(t.wrapS=e.wrapS),e.wrapT!==void 0&&(t.wrapT=e.wrapT),e.wrapR!==void 0&&(t.wrapR=e.wrapR),e.magFilter!==void 0&&(t.magFilter=e.magFilter),e.minFilter!==void 0&&(t.minFilter=e.minFilter),e.format!==void 0&&(t.format=e.format),e.type!==void 0&&(t.type=e.type),e.anisotropy!==void 0&&(t.anisotropy=e.anisotropy),e.colorSpace!==void 0&&(t.colorSpace=e.colorSpace),e.flipY!==void 0&&(t.flipY=e.flipY),e.generateMipmaps!==void 0&&(t.generateMipmaps=e.generateMipmaps),e.mipmapsAutoUpdate!==void 0&&(t.mipmapsAutoUpdate=e.mipmapsAutoUpdate),e.internalFormat!==void 0&&(t.internalFormat=e.internalFormat);for(let i=0;i<this.textures.length;i++)this.textures[i].setValues(t)}get texture(){return this.textures[0]}set texture(e){this.textures[0]=e}set depthTexture(e){this._depthTexture!==null&&this._depthTexture.renderTarget===this&&(this._depthTexture.renderTarget=null),e!==null&&e.renderTarget===null&&(e.renderTarget=this),this._depthTexture=e}get depthTexture(){return this._depthTexture}setSize(e,t,i=1){if(this.width!==e||this.height!==t||this.depth!==i){this.width=e,this.height=t,this.depth=i;for(let s=0,r=this.textures.length;s<r;s++)this.textures[s].image.width=e,this.textures[s].image.height=t,this.textures[s].image.depth=i,this.textures[s].isData3DTexture!==!0&&(this.textures[s].isArrayTexture=this.textures[s].image.depth>1);this.dispose()}this.viewport.set(0,0,e,t),this.scissor.set(0,0,e,t)}clone(){return new this.constructor().copy(this)}copy(e){this.width=e.width,this.height=e.height,this.depth=e.depth,this.scissor.copy(e.scissor),this.scissorTest=e.scissorTest,this.viewport.copy(e.viewport),this.textures.length=0;for(let t=0,i=e.textures.length;t<i;t++){this.textures[t]=e.textures[t].clone(),this.textures[t].isRenderTargetTexture=!0,this.textures[t].renderTarget=this;let s=Object.assign({},e.textures[t].image);this.textures[t].source=new oo(s)}if(this.depthBuffer=e.depthBuffer,this.stencilBuffer=e.stencilBuffer,this.resolveColorBuffer=e.resolveColorBuffer,this.resolveDepthBuffer=e.resolveDepthBuffer,this.resolveStencilBuffer=e.resolveStencilBuffer,this.storeMultisampledColorBuffer=e.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=e.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=e.storeMultisampledStencilBuffer,e.depthTexture!==null)if(e.depthTexture.renderTarget===e){let t=e.depthTexture.clone();t.renderTarget=null,this.depthTexture=t}else this.depthTexture=e.depthTexture;else this.depthTexture=null;return this.samples=e.samples,this.multiview=e.multiview,this.useArrayDepthTexture=e.useArrayDepthTexture,this}dispose(){this.dispatchEvent({type:"dispose"})}},mi=class extends lc{constructor(e=1,t=1,i={}){super(e,t,i),this.isWebGLRenderTarget=!0}},da=class extends ei{constructor(e=null,t=1,i=1,s=1){super(null),this.isDataArrayTexture=!0,this.image={data:e,width:t,height:i,depth:s},this.magFilter=Nn,this.minFilter=Nn,this.wrapR=Qi,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1,this.layerUpdates=new Set}copy(e){return super.copy(e),this.wrapR=e.wrapR,this}addLayerUpdate(e){this.layerUpdates.add(e)}clearLayerUpdates(){this.layerUpdates.clear()}};var cc=class extends ei{constructor(e=null,t=1,i=1,s=1){super(null),this.isData3DTexture=!0,this.image={data:e,width:t,height:i,depth:s},this.magFilter=Nn,this.minFilter=Nn,this.wrapR=Qi,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}copy(e){return super.copy(e),this.wrapR=e.wrapR,this}};var Bt=class n{static{this.prototype.isMatrix4=!0}constructor(e,t,i,s,r,o,a,l,c,u,d,h,f,m,y,g){this.elements=[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],e!==void 0&&this.set(e,t,i,s,r,o,a,l,c,u,d,h,f,m,y,g)}set(e,t,i,s,r,o,a,l,c,u,d,h,f,m,y,g){let _=this.elements;return _[0]=e,_[4]=t,_[8]=i,_[12]=s,_[1]=r,_[5]=o,_[9]=a,_[13]=l,_[2]=c,_[6]=u,_[10]=d,_[14]=h,_[3]=f,_[7]=m,_[11]=y,_[15]=g,this}identity(){return this.set(1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1),this}clone(){return new n().fromArray(this.elements)}copy(e){let t=this.elements,i=e.elements;return t[0]=i[0],t[1]=i[1],t[2]=i[2],t[3]=i[3],t[4]=i[4],t[5]=i[5],t[6]=i[6],t[7]=i[7],t[8]=i[8],t[9]=i[9],t[10]=i[10],t[11]=i[11],t[12]=i[12],t[13]=i[13],t[14]=i[14],t[15]=i[15],this}copyPosition(e){let t=this.elements,i=e.elements;return t[12]=i[12],t[13]=i[13],t[14]=i[14],this}setFromMatrix3(e){let t=e.elements;return this.set(t[0],t[3],t[6],0,t[1],t[4],t[7],0,t[2],t[5],t[8],0,0,0,0,1),this}extractBasis(e,t,i){return this.determinantAffine()===0?(e.set(1,0,0),t.set(0,1,0),i.set(0,0,1),this):(e.setFromMatrixColumn(this,0),t.setFromMatrixColumn(this,1),i.setFromMatrixColumn(this,2),this)}makeBasis(e,t,i){return this.set(e.x,t.x,i.x,0,e.y,t.y,i.y,0,e.z,t.z,i.z,0,0,0,0,1),this}extractRotation(e){if(e.determinantAffine()===0)return this.identity();let t=this.elements,i=e.elements,s=1/kr.setFromMatrixColumn(e,0).length(),r=1/kr.setFromMatrixColumn(e,1).length(),o=1/kr.setFromMatrixColumn(e,2).length();return t[0]=i[0]*s,t[1]=i[1]*s,t[2]=i[2]*s,t[3]=0,t[4]=i[4]*r,t[5]=i[5]*r,t[6]=i[6]*r,t[7]=0,t[8]=i[8]*o,t[9]=i[9]*o,t[10]=i[10]*o,t[11]=0,t[12]=0,t[13]=0,t[14]=0,t[15]=1,this}makeRotationFromEuler(e){let t=this.elements,i=e.x,s=e.y,r=e.z,o=Math.cos(i),a=Math.sin(i),l=Math.cos(s),c=Math.sin(s),u=Math.cos(r),d=Math.sin(r);if(e.order==="XYZ"){let h=o*u,f=o*d,m=a*u,y=a*d;t[0]=l*u,t[4]=-l*d,t[8]=c,t[1]=f+m*c,t[5]=h-y*c,t[9]=-a*l,t[2]=y-h*c,t[6]=m+f*c,t[10]=o*l}else if(e.order==="YXZ"){let h=l*u,f=l*d,m=c*u,y=c*d;t[0]=h+y*a,t[4]=m*a-f,t[8]=o*c,t[1]=o*d,t[5]=o*u,t[9]=-a,t[2]=f*a-m,t[6]=y+h*a,t[10]=o*l}else if(e.order==="ZXY"){let h=l*u,f=l*d,m=c*u,y=c*d;t[0]=h-y*a,t[4]=-o*d,t[8]=m+f*a,t[1]=f+m*a,t[5]=o*u,t[9]=y-h*a,t[2]=-o*c,t[6]=a,t[10]=o*l}else if(e.order==="ZYX"){let h=o*u,f=o*d,m=a*u,y=a*d;t[0]=l*u,t[4]=m*c-f,t[8]=h*c+y,t[1]=l*d,t[5]=y*c+h,t[9]=f*c-m,t[2]=-c,t[6]=a*l,t[10]=o*l}else if(e.order==="YZX"){let h=o*l,f=o*c,m=a*l,y=a*c;t[0]=l*u,t[4]=y-h*d,t[8]=m*d+f,t[1]=d,t[5]=o*u,t[9]=-a*u,t[2]=-c*u,t[6]=f*d+m,t[10]=h-y*d}else if(e.order==="XZY"){let h=o*l,f=o*c,m=a*l,y=a*c;t[0]=l*u,t[4]=-d,t[8]=c*u,t[1]=h*d+y,t[5]=o*u,t[9]=f*d-m,t[2]=m*d-f,t[6]=a*u,t[10]=y*d+h}return t[3]=0,t[7]=0,t[11]=0,t[12]=0,t[13]=0,t[14]=0,t[15]=1,this}makeRotationFromQuaternion(e){return this.compose(vv,e,yv)}lookAt(e,t,i){let s=this.elements;return di.subVectors(e,t),di.lengthSq()===0&&(di.z=1),di.normalize(),zs.crossVectors(i,di),zs.lengthSq()===0&&(Math.abs(i.z)===1?di.x+=1e-4:di.z+=1e-4,di.normalize(),zs.crossVectors(i,di)),zs.normalize(),vl.crossVectors(di,zs),s[0]=zs.x,s[4]=vl.x,s[8]=di.x,s[1]=zs.y,s[5]=vl.y,s[9]=di.y,s[2]=zs.z,s[6]=vl.z,s[10]=di.z,this}multiply(e){return this.multiplyMatrices(this,e)}premultiply(e){return this.multiplyMatrices(e,this)}multiplyMatrices(e,t){let i=e.elements,s=t.elements,r=this.elements,o=i[0],a=i[4],l=i[8],c=i[12],u=i[1],d=i[5],h=i[9],f=i[13],m=i[2],y=i[6],g=i[10],_=i[14],b=i[3],C=i[7],S=i[11],P=i[15],A=s[0],x=s[4],w=s[8],F=s[12],D=s[1],L=s[5],B=s[9],V=s[13],U=s[2],X=s[6],$=s[10],W=s[14],ce=s[3],K=s[7],Q=s[11],se=s[15];return r[0]=o*A+a*D+l*U+c*ce,r[4]=o*x+a*L+l*X+c*K,r[8]=o*w+a*B+l*$+c*Q,r[12]=o*F+a*V+l*W+c*se,r[1]=u*A+d*D+h*U+f*ce,r[5]=u*x+d*L+h*X+f*K,r[9]=u*w+d*B+h*$+f*Q,r[13]=u*F+d*V+h*W+f*se,r[2]=m*A+y*D+g*U+_*ce,r[6]=m*x+y*L+g*X+_*K,r[10]=m*w+y*B+g*$+_*Q,r[14]=m*F+y*V+g*W+_*se,r[3]=b*A+C*D+S*U+P*ce,r[7]=b*x+C*L+S*X+P*K,r[11]=b*w+C*B+S*$+P*Q,r[15]=b*F+C*V+S*W+P*se,this}multiplyScalar(e){let t=this.elements;return t[0]*=e,t[4]*=e,t[8]*=e,t[12]*=e,t[1]*=e,t[5]*=e,t[9]*=e,t[13]*=e,t[2]*=e,t[6]*=e,t[10]*=e,t[14]*=e,t[3]*=e,t[7]*=e,t[11]*=e,t[15]*=e,this}determinant(){let e=this.elements,t=e[0],i=e[4],s=e[8],r=e[12],o=e[1],a=e[5],l=e[9],c=e[13],u=e[2],d=e[6],h=e[10],f=e[14],m=e[3],y=e[7],g=e[11],_=e[15],b=l*f-c*h,C=a*f-c*d,S=a*h-l*d,P=o*f-c*u,A=o*h-l*u,x=o*d-a*u;return t*(y*b-g*C+_*S)-i*(m*b-g*P+_*A)+s*(m*C-y*P+_*x)-r*(m*S-y*A+g*x)}determinantAffine(){let e=this.elements,t=e[0],i=e[4],s=e[8],r=e[1],o=e[5],a=e[9],l=e[2],c=e[6],u=e[10];return t*(o*u-a*c)-i*(r*u-a*l)+s*(r*c-o*l)}transpose(){let e=this.elements,t;return t=e[1],e[1]=e[4],e[4]=t,t=e[2],e[2]=e[8],e[8]=t,t=e[6],e[6]=e[9],e[9]=t,t=e[3],e[3]=e[12],e[12]=t,t=e[7],e[7]=e[13],e[13]=t,t=e[11],e[11]=e[14],e[14]=t,this}setPosition(e,t,i){let s=this.elements;return e.isVector3?(s[12]=e.x,s[13]=e.y,s[14]=e.z):(s[12]=e,s[13]=t,s[14]=i),this}invert(){let e=this.elements,t=e[0],i=e[1],s=e[2],r=e[3],o=e[4],a=e[5],l=e[6],c=e[7],u=e[8],d=e[9],h=e[10],f=e[11],m=e[12],y=e[13],g=e[14],_=e[15],b=t*a-i*o,C=t*l-s*o,S=t*c-r*o,P=i*l-s*a,A=i*c-r*a,x=s*c-r*l,w=u*y-d*m,F=u*g-h*m,D=u*_-f*m,L=d*g-h*y,B=d*_-f*y,V=h*_-f*g,U=b*V-C*B+S*L+P*D-A*F+x*w;if(U===0)return this.set(0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0);let X=1/U;return e[0]=(a*V-l*B+c*L)*X,e[1]=(s*B-i*V-r*L)*X,e[2]=(y*x-g*A+_*P)*X,e[3]=(h*A-d*x-f*P)*X,e[4]=(l*D-o*V-c*F)*X,e[5]=(t*V-s*D+r*F)*X,e[6]=(g*S-m*x-_*C)*X,e[7]=(u*x-h*S+f*C)*X,e[8]=(o*B-a*D+c*w)*X,e[9]=(i*D-t*B-r*w)*X,e[10]=(m*A-y*S+_*b)*X,e[11]=(d*S-u*A-f*b)*X,e[12]=(a*F-o*L-l*w)*X,e[13]=(t*L-i*F+s*w)*X,e[14]=(y*C-m*P-g*b)*X,e[15]=(u*P-d*C+h*b)*X,this}scale(e){let t=this.elements,i=e.x,s=e.y,r=e.z;return t[0]*=i,t[4]*=s,t[8]*=r,t[1]*=i,t[5]*=s,t[9]*=r,t[2]*=i,t[6]*=s,t[10]*=r,t[3]*=i,t[7]*=s,t[11]*=r,this}getMaxScaleOnAxis(){let e=this.elements,t=e[0]*e[0]+e[1]*e[1]+e[2]*e[2],i=e[4]*e[4]+e[5]*e[5]+e[6]*e[6],s=e[8]*e[8]+e[9]*e[9]+e[10]*e[10];return Math.sqrt(Math.max(t,i,s))}makeTranslation(e,t,i){return e.isVector3?this.set(1,0,0,e.x,0,1,0,e.y,0,0,1,e.z,0,0,0,1):this.set(1,0,0,e,0,1,0,t,0,0,1,i,0,0,0,1),this}makeRotationX(e){let t=Math.cos(e),i=Math.sin(e);return this.set(1,0,0,0,0,t,-i,0,0,i,t,0,0,0,0,1),this}makeRotationY(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,0,i,0,0,1,0,0,-i,0,t,0,0,0,0,1),this}makeRotationZ(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,-i,0,0,i,t,0,0,0,0,1,0,0,0,0,1),this}makeRotationAxis(e,t){let i=Math.cos(t),s=Math.sin(t),r=1-i,o=e.x,a=e.y,l=e.z,c=r*o,u=r*a;return this.set(c*o+i,c*a-s*l,c*l+s*a,0,c*a+s*l,u*a+i,u*l-s*o,0,c*l-s*a,u*l+s*o,r*l*l+i,0,0,0,0,1),this}makeScale(e,t,i){return this.set(e,0,0,0,0,t,0,0,0,0,i,0,0,0,0,1),this}makeShear(e,t,i,s,r,o){return this.set(1,i,r,0,e,1,o,0,t,s,1,0,0,0,0,1),this}compose(e,t,i){let s=this.elements,r=t._x,o=t._y,a=t._z,l=t._w,c=r+r,u=o+o,d=a+a,h=r*c,f=r*u,m=r*d,y=o*u,g=o*d,_=a*d,b=l*c,C=l*u,S=l*d,P=i.x,A=i.y,x=i.z;return s[0]=(1-(y+_))*P,s[1]=(f+S)*P,s[2]=(m-C)*P,s[3]=0,s[4]=(f-S)*A,s[5]=(1-(h+_))*A,s[6]=(g+b)*A,s[7]=0,s[8]=(m+C)*x,s[9]=(g-b)*x,s[10]=(1-(h+y))*x,s[11]=0,s[12]=e.x,s[13]=e.y,s[14]=e.z,s[15]=1,this}decompose(e,t,i){let s=this.elements;e.x=s[12],e.y=s[13],e.z=s[14];let r=this.determinantAffine();if(r===0)return i.set(1,1,1),t.identity(),this;let o=kr.set(s[0],s[1],s[2]).length(),a=kr.set(s[4],s[5],s[6]).length(),l=kr.set(s[8],s[9],s[10]).length();r<0&&(o=-o),Pi.copy(this);let c=1/o,u=1/a,d=1/l;return Pi.elements[0]*=c,Pi.elements[1]*=c,Pi.elements[2]*=c,Pi.elements[4]*=u,Pi.elements[5]*=u,Pi.elements[6]*=u,Pi.elements[8]*=d,Pi.elements[9]*=d,Pi.elements[10]*=d,t.setFromRotationMatrix(Pi),i.x=o,i.y=a,i.z=l,this}makePerspective(e,t,i,s,r,o,a=Mi,l=!1){let c=this.elements,u=2*r/(t-e),d=2*r/(i-s),h=(t+e)/(t-e),f=(i+s)/(i-s),m,y;if(l)m=r/(o-r),y=o*r/(o-r);else if(a===Mi)m=-(o+r)/(o-r),y=-2*o*r/(o-r);else if(a===io)m=-o/(o-r),y=-o*r/(o-r);else throw new Error("THREE.Matrix4.makePerspective(): Invalid coordinate system: "+a);return c[0]=u,c[4]=0,c[8]=h,c[12]=0,c[1]=0,c[5]=d,c[9]=f,c[13]=0,c[2]=0,c[6]=0,c[10]=m,c[14]=y,c[3]=0,c[7]=0,c[11]=-1,c[15]=0,this}makeOrthographic(e,t,i,s,r,o,a=Mi,l=!1){let c=this.elements,u=2/(t-e),d=2/(i-s),h=-(t+e)/(t-e),f=-(i+s)/(i-s),m,y;if(l)m=1/(o-r),y=o/(o-r);else if(a===Mi)m=-2/(o-r),y=-(o+r)/(o-r);else if(a===io)m=-1/(o-r),y=-r/(o-r);else throw new Error("THREE.Matrix4.makeOrthographic(): Invalid coordinate system: "+a);return c[0]=u,c[4]=0,c[8]=0,c[12]=h,c[1]=0,c[5]=d,c[9]=0,c[13]=f,c[2]=0,c[6]=0,c[10]=m,c[14]=y,c[3]=0,c[7]=0,c[11]=0,c[15]=1,this}equals(e){let t=this.elements,i=e.elements;for(let s=0;s<16;s++)if(t[s]!==i[s])return!1;return!0}fromArray(e,t=0){for(let i=0;i<16;i++)this.elements[i]=e[i+t];return this}toArray(e=[],t=0){let i=this.elements;return e[t]=i[0],e[t+1]=i[1],e[t+2]=i[2],e[t+3]=i[3],e[t+4]=i[4],e[t+5]=i[5],e[t+6]=i[6],e[t+7]=i[7],e[t+8]=i[8],e[t+9]=i[9],e[t+10]=i[10],e[t+11]=i[11],e[t+12]=i[12],e[t+13]=i[13],e[t+14]=i[14],e[t+15]=i[15],e}},kr=new H,Pi=new Bt,vv=new H(0,0,0),yv=new H(1,1,1),zs=new H,vl=new H,di=new H,rm=new Bt,om=new Un,Ms=class n{constructor(e=0,t=0,i=0,s=n.DEFAULT_ORDER){this.isEuler=!0,this._x=e,this._y=t,this._z=i,this._order=s}get x(){return this._x}set x(e){this._x=e,this._onChangeCallback()}get y(){return this._y}set y(e){this._y=e,this._onChangeCallback()}get z(){return this._z}set z(e){this._z=e,this._onChangeCallback()}get order(){return this._order}set order(e){this._order=e,this._onChangeCallback()}set(e,t,i,s=this._order){return this._x=e,this._y=t,this._z=i,this._order=s,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._order)}copy(e){return this._x=e._x,this._y=e._y,this._z=e._z,this._order=e._order,this._onChangeCallback(),this}setFromRotationMatrix(e,t=this._order,i=!0){let s=e.elements,r=s[0],o=s[4],a=s[8],l=s[1],c=s[5],u=s[9],d=s[2],h=s[6],f=s[10];switch(t){case"XYZ":this._y=Math.asin(mt(a,-1,1)),Math.abs(a)<.9999999?(this._x=Math.atan2(-u,f),this._z=Math.atan2(-o,r)):(this._x=Math.atan2(h,c),this._z=0);break;case"YXZ":this._x=Math.asin(-mt(u,-1,1)),Math.abs(u)<.9999999?(this._y=Math.atan2(a,f),this._z=Math.atan2(l,c)):(this._y=Math.atan2(-d,r),this._z=0);break;case"ZXY":this._x=Math.asin(mt(h,-1,1)),Math.abs(h)<.9999999?(this._y=Math.atan2(-d,f),this._z=Math.atan2(-o,c)):(this._y=0,this._z=Math.atan2(l,r));break;case"ZYX":this._y=Math.asin(-mt(d,-1,1)),Math.abs(d)<.9999999?(this._x=Math.atan2(h,f),this._z=Math.atan2(l,r)):(this._x=0,this._z=Math.atan2(-o,c));break;case"YZX":this._z=Math.asin(mt(l,-1,1)),Math.abs(l)<.9999999?(this._x=Math.atan2(-u,c),this._y=Math.atan2(-d,r)):(this._x=0,this._y=Math.atan2(a,f));break;case"XZY":this._z=Math.asin(-mt(o,-1,1)),Math.abs(o)<.9999999?(this._x=Math.atan2(h,c),this._y=Math.atan2(a,r)):(this._x=Math.atan2(-u,f),this._y=0);break;default:$e("Euler: .setFromRotationMatrix() encountered an unknown order: "+t)}return this._order=t,i===!0&&this._onChangeCallback(),this}setFromQuaternion(e,t,i){return rm.makeRotationFromQuaternion(e),this.setFromRotationMatrix(rm,t,i)}setFromVector3(e,t=this._order){return this.set(e.x,e.y,e.z,t)}reorder(e){return om.setFromEuler(this),this.setFromQuaternion(om,e)}equals(e){return e._x===this._x&&e._y===this._y&&e._z===this._z&&e._order===this._order}fromArray(e){return this._x=e[0],this._y=e[1],this._z=e[2],e[3]!==void 0&&(this._order=e[3]),this._onChangeCallback(),this}toArray(e=[],t=0){return e[t]=this._x,e[t+1]=this._y,e[t+2]=this._z,e[t+3]=this._order,e}_onChange(e){return this._onChangeCallback=e,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._order}};Ms.DEFAULT_ORDER="XYZ";var fa=class{constructor(){this.mask=1}set(e){this.mask=(1<<e|0)>>>0}enable(e){this.mask|=1<<e|0}enableAll(){this.mask=-1}toggle(e){this.mask^=1<<e|0}disable(e){this.mask&=~(1<<e|0)}disableAll(){this.mask=0}test(e){return(this.mask&e.mask)!==0}isEnabled(e){return(this.mask&(1<<e|0))!==0}},bv=0,am=new H,Br=new Un,gs=new Bt,yl=new H,Ko=new H,Sv=new H,Mv=new Un,lm=new H(1,0,0),cm=new H(0,1,0),um=new H(0,0,1),hm={type:"added"},wv={type:"removed"},zr={type:"childadded",child:null},kh={type:"childremoved",child:null},Sn=class n extends Ui{constructor(){super(),this.isObject3D=!0,Object.defineProperty(this,"id",{value:bv++}),this.uuid=tr(),this.name="",this.type="Object3D",this.parent=null,this.children=[],this.up=n.DEFAULT_UP.clone();let e=new H,t=new Ms,i=new Un,s=new H(1,1,1);function r(){i.setFromEuler(t,!1)}function o(){t.setFromQuaternion(i,void 0,!1)}t._onChange(r),i._onChange(o),Object.defineProperties(this,{position:{configurable:!0,enumerable:!0,value:e},rotation:{configurable:!0,enumerable:!0,value:t},quaternion:{configurable:!0,enumerable:!0,value:i},scale:{configurable:!0,enumerable:!0,value:s},modelViewMatrix:{value:new Bt},normalMatrix:{value:new nt}}),this.matrix=new Bt,this.matrixWorld=new Bt,this.matrixAutoUpdate=n.DEFAULT_MATRIX_AUTO_UPDATE,this.matrixWorldAutoUpdate=n.DEFAULT_MATRIX_WORLD_AUTO_UPDATE,this.matrixWorldNeedsUpdate=!1,this.layers=new fa,this.visible=!0,this.castShadow=!1,this.receiveShadow=!1,this.frustumCulled=!0,this.renderOrder=0,this.animations=[],this.customDepthMaterial=void 0,this.customDistanceMaterial=void 0,this.static=!1,this.userData={},this.pivot=null}onBeforeShadow(){}onAfterShadow(){}onBeforeRender(){}onAfterRender(){}applyMatrix4(e){this.matrixAutoUpdate&&this.updateMatrix(),this.matrix.premultiply(e),this.matrix.decompose(this.position,this.quaternion,this.scale),this.pivot!==null&&this.position.copy(this.pivot).applyMatrix4(this.matrix).sub(this.pivot)}applyQuaternion(e){return this.quaternion.premultiply(e),this}setRotationFromAxisAngle(e,t){this.quaternion.setFromAxisAngle(e,t)}setRotationFromEuler(e){this.quaternion.setFromEuler(e,!0)}setRotationFromMatrix(e){this.quaternion.setFromRotationMatrix(e)}setRotationFromQuaternion(e){this.quaternion.copy(e)}rotateOnAxis(e,t){return Br.setFromAxisAngle(e,t),this.quaternion.multiply(Br),this}rotateOnWorldAxis(e,t){return Br.setFromAxisAngle(e,t),this.quaternion.premultiply(Br),this}rotateX(e){return this.rotateOnAxis(lm,e)}rotateY(e){return this.rotateOnAxis(cm,e)}rotateZ(e){return this.rotateOnAxis(um,e)}translateOnAxis(e,t){return am.copy(e).applyQuaternion(this.quaternion),this.position.add(am.multiplyScalar(t)),this}translateX(e){return this.translateOnAxis(lm,e)}translateY(e){return this.translateOnAxis(cm,e)}translateZ(e){return this.translateOnAxis(um,e)}localToWorld(e){return this.updateWorldMatrix(!0,!1),e.applyMatrix4(this.matrixWorld)}worldToLocal(e){return this.updateWorldMatrix(!0,!1),e.applyMatrix4(gs.copy(this.matrixWorld).invert())}lookAt(e,t,i){e.isVector3?yl.copy(e):yl.set(e,t,i);let s=this.parent;this.updateWorldMatrix(!0,!1),Ko.setFromMatrixPosition(this.matrixWorld),this.isCamera||this.isLight?gs.lookAt(Ko,yl,this.up):gs.lookAt(yl,Ko,this.up),this.quaternion.setFromRotationMatrix(gs),s&&(gs.extractRotation(s.matrixWorld),Br.setFromRotationMatrix(gs),this.quaternion.premultiply(Br.invert()))}add(e){if(arguments.length>1){for(let t=0;t<arguments.length;t++)this.add(arguments[t]);return this}return e===this?(Qe("Object3D.add: object can't be added as a child of itself.",e),this):(e&&e.isObject3D?(e.removeFromParent(),e.parent=this,this.children.push(e),e.dispatchEvent(hm),zr.child=e,this.dispatchEvent(zr),zr.child=null):Qe("Object3D.add: object not an instance of THREE.Object3D.",e),this)}remove(e){if(arguments.length>1){for(let i=0;i<arguments.length;i++)this.remove(arguments[i]);return this}let t=this.children.indexOf(e);return t!==-1&&(e.parent=null,this.children.splice(t,1),e.dispatchEvent(wv),kh.child=e,this.dispatchEvent(kh),kh.child=null),this}removeFromParent(){let e=this.parent;return e!==null&&e.remove(this),this}clear(){return this.remove(...this.children)}attach(e){return this.updateWorldMatrix(!0,!1),gs.copy(this.matrixWorld).invert(),e.parent!==null&&(e.parent.updateWorldMatrix(!0,!1),gs.multiply(e.parent.matrixWorld)),e.applyMatrix4(gs),e.removeFromParent(),e.parent=this,this.children.push(e),e.updateWorldMatrix(!1,!0),e.dispatchEvent(hm),zr.child=e,this.dispatchEvent(zr),zr.child=null,this}getObjectById(e){return this.getObjectByProperty("id",e)}getObjectByName(e){return this.getObjectByProperty("name",e)}getObjectByProperty(e,t){if(this[e]===t)return this;for(let i=0,s=this.children.length;i<s;i++){let o=this.children[i].getObjectByProperty(e,t);if(o!==void 0)return o}}getObjectsByProperty(e,t,i=[]){this[e]===t&&i.push(this);let s=this.children;for(let r=0,o=s.length;r<o;r++)s[r].getObjectsByProperty(e,t,i);return i}getWorldPosition(e){return this.updateWorldMatrix(!0,!1),e.setFromMatrixPosition(this.matrixWorld)}getWorldQuaternion(e){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(Ko,e,Sv),e}getWorldScale(e){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(Ko,Mv,e),e}getWorldDirection(e){this.updateWorldMatrix(!0,!1);let t=this.matrixWorld.elements;return e.set(t[8],t[9],t[10]).normalize()}raycast(){}intersectsFrustum(){return!0}traverse(e){e(this);let t=this.children;for(let i=0,s=t.length;i<s;i++)t[i].traverse(e)}traverseVisible(e){if(this.visible===!1)return;e(this);let t=this.children;for(let i=0,s=t.length;i<s;i++)t[i].traverseVisible(e)}traverseAncestors(e){let t=this.parent;t!==null&&(e(t),t.traverseAncestors(e))}updateMatrix(){this.matrix.compose(this.position,this.quaternion,this.scale);let e=this.pivot;if(e!==null){let t=e.x,i=e.y,s=e.z,r=this.matrix.elements;r[12]+=t-r[0]*t-r[4]*i-r[8]*s,r[13]+=i-r[1]*t-r[5]*i-r[9]*s,r[14]+=s-r[2]*t-r[6]*i-r[10]*s}this.matrixWorldNeedsUpdate=!0}updateMatrixWorld(e){this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||e)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,e=!0);let t=this.children;for(let i=0,s=t.length;i<s;i++)t[i].updateMatrixWorld(e)}updateWorldMatrix(e,t,i=!1){let s=this.parent;if(e===!0&&s!==null&&s.updateWorldMatrix(!0,!1),this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||i)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,i=!0),t===!0){let r=this.children;for(let o=0,a=r.length;o<a;o++)r[o].updateWorldMatrix(!1,!0,i)}}toJSON(e){let t=e===void 0||typeof e=="string",i={};t&&(e={geometries:{},materials:{},textures:{},images:{},shapes:{},skeletons:{},animations:{},nodes:{}},i.metadata={version:4.7,type:"Object",generator:"Object3D.toJSON"});let s={};s.uuid=this.uuid,s.type=this.type,s.name=this.name,s.castShadow=this.castShadow,s.receiveShadow=this.receiveShadow,s.visible=this.visible,s.frustumCulled=this.frustumCulled,s.renderOrder=this.renderOrder,s.static=this.static,s.matrixAutoUpdate=this.matrixAutoUpdate,Object.keys(this.userData).length>0&&(s.userData=this.userData),s.layers=this.layers.mask,s.matrix=this.matrix.toArray(),s.up=this.up.toArray(),this.pivot!==null&&(s.pivot=this.pivot.toArray()),this.morphTargetDictionary!==void 0&&(s.morphTargetDictionary=Object.assign({},this.morphTargetDictionary)),this.morphTargetInfluences!==void 0&&(s.morphTargetInfluences=this.morphTargetInfluences.slice()),this.isInstancedMesh&&(s.type="InstancedMesh",s.count=this.count,s.instanceMatrix=this.instanceMatrix.toJSON(),this.instanceColor!==null&&(s.instanceColor=this.instanceColor.toJSON())),this.isBatchedMesh&&(s.type="BatchedMesh",s.perObjectFrustumCulled=this.perObjectFrustumCulled,s.sortObjects=this.sortObjects,s.drawRanges=this._drawRanges,s.reservedRanges=this._reservedRanges,s.geometryInfo=this._geometryInfo.map(a=>({...a,boundingBox:a.boundingBox?a.boundingBox.toJSON():void 0,boundingSphere:a.boundingSphere?a.boundingSphere.toJSON():void 0})),s.instanceInfo=this._instanceInfo.map(a=>({...a})),s.availableInstanceIds=this._availableInstanceIds.slice(),s.availableGeometryIds=this._availableGeometryIds.slice(),s.nextIndexStart=this._nextIndexStart,s.nextVertexStart=this._nextVertexStart,s.geometryCount=this._geometryCount,s.maxInstanceCount=this._maxInstanceCount,s.maxVertexCount=this._maxVertexCount,s.maxIndexCount=this._maxIndexCount,s.geometryInitialized=this._geometryInitialized,s.matricesTexture=this._matricesTexture.toJSON(e),s.indirectTexture=this._indirectTexture.toJSON(e),this._colorsTexture!==null&&(s.colorsTexture=this._colorsTexture.toJSON(e)),this.boundingSphere!==null&&(s.boundingSphere=this.boundingSphere.toJSON()),this.boundingBox!==null&&(s.boundingBox=this.boundingBox.toJSON()));function r(a,l){return a[l.uuid]===void 0&&(a[l.uuid]=l.toJSON(e)),l.uuid}if(this.isScene)this.background&&(this.background.isColor?s.background=this.background.toJSON():this.background.isTexture&&(s.background=this.background.toJSON(e).uuid)),this.environment&&this.environment.isTexture&&this.environment.isRenderTargetTexture!==!0&&(s.environment=this.environment.toJSON(e).uuid);else if(this.isMesh||this.isLine||this.isPoints){s.geometry=r(e.geometries,this.geometry);let a=this.geometry.parameters;if(a!==void 0&&a.shapes!==void 0){let l=a.shapes;if(Array.isArray(l))for(let c=0,u=l.length;c<u;c++){let d=l[c];r(e.shapes,d)}else r(e.shapes,l)}}if(this.isSkinnedMesh&&(s.bindMode=this.bindMode,s.bindMatrix=this.bindMatrix.toArray(),this.skeleton!==void 0&&(r(e.skeletons,this.skeleton),s.skeleton=this.skeleton.uuid)),this.material!==void 0)if(Array.isArray(this.material)){let a=[];for(let l=0,c=this.material.length;l<c;l++)a.push(r(e.materials,this.material[l]));s.material=a}else s.material=r(e.materials,this.material);if(this.children.length>0){s.children=[];for(let a=0;a<this.children.length;a++)s.children.push(this.children[a].toJSON(e).object)}if(this.animations.length>0){s.animations=[];for(let a=0;a<this.animations.length;a++){let l=this.animations[a];s.animations.push(r(e.animations,l))}}if(t){let a=o(e.geometries),l=o(e.materials),c=o(e.textures),u=o(e.images),d=o(e.shapes),h=o(e.skeletons),f=o(e.animations),m=o(e.nodes);a.length>0&&(i.geometries=a),l.length>0&&(i.materials=l),c.length>0&&(i.textures=c),u.length>0&&(i.images=u),d.length>0&&(i.shapes=d),h.length>0&&(i.skeletons=h),f.length>0&&(i.animations=f),m.length>0&&(i.nodes=m)}return i.object=s,i;function o(a){let l=[];for(let c in a){let u=a[c];delete u.metadata,l.push(u)}return l}}clone(e){return new this.constructor().copy(this,e)}copy(e,t=!0){if(this.name=e.name,this.up.copy(e.up),this.position.copy(e.position),this.rotation.order=e.rotation.order,this.quaternion.copy(e.quaternion),this.scale.copy(e.scale),this.pivot=e.pivot!==null?e.pivot.clone():null,this.matrix.copy(e.matrix),this.matrixWorld.copy(e.matrixWorld),this.matrixAutoUpdate=e.matrixAutoUpdate,this.matrixWorldAutoUpdate=e.matrixWorldAutoUpdate,this.matrixWorldNeedsUpdate=e.matrixWorldNeedsUpdate,this.layers.mask=e.layers.mask,this.visible=e.visible,this.castShadow=e.castShadow,this.receiveShadow=e.receiveShadow,this.frustumCulled=e.frustumCulled,this.renderOrder=e.renderOrder,this.static=e.static,this.animations=e.animations.slice(),this.userData=JSON.parse(JSON.stringify(e.userData)),t===!0)for(let i=0;i<e.children.length;i++){let s=e.children[i];this.add(s.clone())}return this}dispose(){this.dispatchEvent({type:"dispose"})}};Sn.DEFAULT_UP=new H(0,1,0);Sn.DEFAULT_MATRIX_AUTO_UPDATE=!0;Sn.DEFAULT_MATRIX_WORLD_AUTO_UPDATE=!0;var Di=class extends Sn{constructor(){super(),this.isGroup=!0,this.type="Group"}},Tv={type:"move"},ao=class{constructor(){this._targetRay=null,this._grip=null,this._hand=null}getHandSpace(){return this._hand===null&&(this._hand=new Di,this._hand.matrixAutoUpdate=!1,this._hand.visible=!1,this._hand.joints={},this._hand.inputState={pinching:!1}),this._hand}getTargetRaySpace(){return this._targetRay===null&&(this._targetRay=new Di,this._targetRay.matrixAutoUpdate=!1,this._targetRay.visible=!1,this._targetRay.hasLinearVelocity=!1,this._targetRay.linearVelocity=new H,this._targetRay.hasAngularVelocity=!1,this._targetRay.angularVelocity=new H),this._targetRay}getGripSpace(){return this._grip===null&&(this._grip=new Di,this._grip.matrixAutoUpdate=!1,this._grip.visible=!1,this._grip.hasLinearVelocity=!1,this._grip.linearVelocity=new H,this._grip.hasAngularVelocity=!1,this._grip.angularVelocity=new H,this._grip.eventsEnabled=!1),this._grip}dispatchEvent(e){return this._targetRay!==null&&this._targetRay.dispatchEvent(e),this._grip!==null&&this._grip.dispatchEvent(e),this._hand!==null&&this._hand.dispatchEvent(e),this}connect(e){if(e&&e.hand){let t=this._hand;if(t)for(let i of e.hand.values())this._getHandJoint(t,i)}return this.dispatchEvent({type:"connected",data:e}),this}disconnect(e){return this.dispatchEvent({type:"disconnected",data:e}),this._targetRay!==null&&(this._targetRay.visible=!1),this._grip!==null&&(this._grip.visible=!1),this._hand!==null&&(this._hand.visible=!1),this}update(e,t,i){let s=null,r=null,o=null,a=this._targetRay,l=this._grip,c=this._hand;if(e&&t.session.visibilityState!=="visible-blurred"){if(c&&e.hand){o=!0;for(let y of e.hand.values()){let g=t.getJointPose(y,i),_=this._getHandJoint(c,y);g!==null&&(_.matrix.fromArray(g.transform.matrix),_.matrix.decompose(_.position,_.quaternion,_.scale),_.matrixWorldNeedsUpdate=!0,_.jointRadius=g.radius),_.visible=g!==null}let u=c.joints["index-finger-tip"],d=c.joints["thumb-tip"],h=u.position.distanceTo(d.position),f=.02,m=.005;c.inputState.pinching&&h>f+m?(c.inputState.pinching=!1,this.dispatchEvent({type:"pinchend",handedness:e.handedness,target:this})):!c.inputState.pinching&&h<=f-m&&(c.inputState.pinching=!0,this.dispatchEvent({type:"pinchstart",handedness:e.handedness,target:this}))}else l!==null&&e.gripSpace&&(r=t.getPose(e.gripSpace,i),r!==null&&(l.matrix.fromArray(r.transform.matrix),l.matrix.decompose(l.position,l.quaternion,l.scale),l.matrixWorldNeedsUpdate=!0,r.linearVelocity?(l.hasLinearVelocity=!0,l.linearVelocity.copy(r.linearVelocity)):l.hasLinearVelocity=!1,r.angularVelocity?(l.hasAngularVelocity=!0,l.angularVelocity.copy(r.angularVelocity)):l.hasAngularVelocity=!1,l.eventsEnabled&&l.dispatchEvent({type:"gripUpdated",data:e,target:this})));a!==null&&(s=t.getPose(e.targetRaySpace,i),s===null&&r!==null&&(s=r),s!==null&&(a.matrix.fromArray(s.transform.matrix),a.matrix.decompose(a.position,a.quaternion,a.scale),a.matrixWorldNeedsUpdate=!0,s.linearVelocity?(a.hasLinearVelocity=!0,a.linearVelocity.copy(s.linearVelocity)):a.hasLinearVelocity=!1,s.angularVelocity?(a.hasAngularVelocity=!0,a.angularVelocity.copy(s.angularVelocity)):a.hasAngularVelocity=!1,this.dispatchEvent(Tv)))}return a!==null&&(a.visible=s!==null),l!==null&&(l.visible=r!==null),c!==null&&(c.visible=o!==null),this}_getHandJoint(e,t){if(e.joints[t.jointName]===void 0){let i=new Di;i.matrixAutoUpdate=!1,i.visible=!1,e.joints[t.jointName]=i,e.add(i)}return e.joints[t.jointName]}},mg={aliceblue:15792383,antiquewhite:16444375,aqua:65535,aquamarine:8388564,azure:15794175,beige:16119260,bisque:16770244,black:0,blanchedalmond:16772045,blue:255,blueviolet:9055202,brown:10824234,burlywood:14596231,cadetblue:6266528,chartreuse:8388352,chocolate:13789470,coral:16744272,cornflowerblue:6591981,cornsilk:16775388,crimson:14423100,cyan:65535,darkblue:139,darkcyan:35723,darkgoldenrod:12092939,darkgray:11119017,darkgreen:25600,darkgrey:11119017,darkkhaki:12433259,darkmagenta:9109643,darkolivegreen:5597999,darkorange:16747520,darkorchid:10040012,darkred:9109504,darksalmon:15308410,darkseagreen:9419919,darkslateblue:4734347,darkslategray:3100495,darkslategrey:3100495,darkturquoise:52945,darkviolet:9699539,deeppink:16716947,deepskyblue:49151,dimgray:6908265,dimgrey:6908265,dodgerblue:2003199,firebrick:11674146,floralwhite:16775920,forestgreen:2263842,fuchsia:16711935,gainsboro:14474460,ghostwhite:16316671,gold:16766720,goldenrod:14329120,gray:8421504,green:32768,greenyellow:11403055,grey:8421504,honeydew:15794160,hotpink:16738740,indianred:13458524,indigo:4915330,ivory:16777200,khaki:15787660,lavender:15132410,lavenderblush:16773365,lawngreen:8190976,lemonchiffon:16775885,lightblue:11393254,lightcoral:15761536,lightcyan:14745599,lightgoldenrodyellow:16448210,lightgray:13882323,lightgreen:9498256,lightgrey:13882323,lightpink:16758465,lightsalmon:16752762,lightseagreen:2142890,lightskyblue:8900346,lightslategray:7833753,lightslategrey:7833753,lightsteelblue:11584734,lightyellow:16777184,lime:65280,limegreen:3329330,linen:16445670,magenta:16711935,maroon:8388608,mediumaquamarine:6737322,mediumblue:205,mediumorchid:12211667,mediumpurple:9662683,mediumseagreen:3978097,mediumslateblue:8087790,mediumspringgreen:64154,mediumturquoise:4772300,mediumvioletred:13047173,midnightblue:1644912,mintcream:16121850,mistyrose:16770273,moccasin:16770229,navajowhite:16768685,navy:128,oldlace:16643558,olive:8421376,olivedrab:7048739,orange:16753920,orangered:16729344,orchid:14315734,palegoldenrod:15657130,palegreen:10025880,paleturquoise:11529966,palevioletred:14381203,papayawhip:16773077,peachpuff:16767673,peru:13468991,pink:16761035,plum:14524637,powderblue:11591910,purple:8388736,rebeccapurple:6697881,red:16711680,rosybrown:12357519,royalblue:4286945,saddlebrown:9127187,salmon:16416882,sandybrown:16032864,seagreen:3050327,seashell:16774638,sienna:10506797,silver:12632256,skyblue:8900331,slateblue:6970061,slategray:7372944,slategrey:7372944,snow:16775930,springgreen:65407,steelblue:4620980,tan:13808780,teal:32896,thistle:14204888,tomato:16737095,turquoise:4251856,violet:15631086,wheat:16113331,white:16777215,whitesmoke:16119285,yellow:16776960,yellowgreen:10145074},Vs={h:0,s:0,l:0},bl={h:0,s:0,l:0};function Bh(n,e,t){return t<0&&(t+=1),t>1&&(t-=1),t<1/6?n+(e-n)*6*t:t<1/2?e:t<2/3?n+(e-n)*6*(2/3-t):n}var tt=class{constructor(e,t,i){return this.isColor=!0,this.r=1,this.g=1,this.b=1,this.set(e,t,i)}set(e,t,i){if(t===void 0&&i===void 0){let s=e;s&&s.isColor?this.copy(s):typeof s=="number"?this.setHex(s):typeof s=="string"&&this.setStyle(s)}else this.setRGB(e,t,i);return this}setScalar(e){return this.r=e,this.g=e,this.b=e,this}setHex(e,t=Kn){return e=Math.floor(e),this.r=(e>>16&255)/255,this.g=(e>>8&255)/255,this.b=(e&255)/255,yt.colorSpaceToWorking(this,t),this}setRGB(e,t,i,s=yt.workingColorSpace){return this.r=e,this.g=t,this.b=i,yt.colorSpaceToWorking(this,s),this}setHSL(e,t,i,s=yt.workingColorSpace){if(e=kd(e,1),t=mt(t,0,1),i=mt(i,0,1),t===0)this.r=this.g=this.b=i;else{let r=i<=.5?i*(1+t):i+t-i*t,o=2*i-r;this.r=Bh(o,r,e+1/3),this.g=Bh(o,r,e),this.b=Bh(o,r,e-1/3)}return yt.colorSpaceToWorking(this,s),this}setStyle(e,t=Kn){function i(r){r!==void 0&&parseFloat(r)<1&&$e("Color: Alpha component of "+e+" will be ignored.")}let s;if(s=/^(\w+)\(([^\)]*)\)/.exec(e)){let r,o=s[1],a=s[2];switch(o){case"rgb":case"rgba":if(r=/^\s*(\d+)\s*,\s*(\d+)\s*,\s*(\d+)\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setRGB(Math.min(255,parseInt(r[1],10))/255,Math.min(255,parseInt(r[2],10))/255,Math.min(255,parseInt(r[3],10))/255,t);if(r=/^\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setRGB(Math.min(100,parseFloat(r[1]))/100,Math.min(100,parseFloat(r[2]))/100,Math.min(100,parseFloat(r[3]))/100,t);break;case"hsl":case"hsla":if(r=/^\s*([+-]?(?:\d+(?:\.\d+)?|\.\d+))\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setHSL(parseFloat(r[1])/360,parseFloat(r[2])/100,parseFloat(r[3])/100,t);break;default:$e("Color: Unknown color model "+e)}}else if(s=/^\#([A-Fa-f\d]+)$/.exec(e)){let r=s[1],o=r.length;if(o===3)return this.setRGB(parseInt(r.charAt(0),16)/15,parseInt(r.charAt(1),16)/15,parseInt(r.charAt(2),16)/15,t);if(o===6)return this.setHex(parseInt(r,16),t);$e("Color: Invalid hex color "+e)}else if(e&&e.length>0)return this.setColorName(e,t);return this}setColorName(e,t=Kn){let i=mg[e.toLowerCase()];return i!==void 0?this.setHex(i,t):$e("Color: Unknown color "+e),this}clone(){return new this.constructor(this.r,this.g,this.b)}copy(e){return this.r=e.r,this.g=e.g,this.b=e.b,this}copySRGBToLinear(e){return this.r=bs(e.r),this.g=bs(e.g),this.b=bs(e.b),this}copyLinearToSRGB(e){return this.r=to(e.r),this.g=to(e.g),this.b=to(e.b),this}convertSRGBToLinear(){return this.copySRGBToLinear(this),this}convertLinearToSRGB(){return this.copyLinearToSRGB(this),this}getHex(e=Kn){return yt.workingToColorSpace(Hn.copy(this),e),Math.round(mt(Hn.r*255,0,255))*65536+Math.round(mt(Hn.g*255,0,255))*256+Math.round(mt(Hn.b*255,0,255))}getHexString(e=Kn){return("000000"+this.getHex(e).toString(16)).slice(-6)}getHSL(e,t=yt.workingColorSpace){yt.workingToColorSpace(Hn.copy(this),t);let i=Hn.r,s=Hn.g,r=Hn.b,o=Math.max(i,s,r),a=Math.min(i,s,r),l,c,u=(a+o)/2;if(a===o)l=0,c=0;else{let d=o-a;switch(c=u<=.5?d/(o+a):d/(2-o-a),o){case i:l=(s-r)/d+(s<r?6:0);break;case s:l=(r-i)/d+2;break;case r:l=(i-s)/d+4;break}l/=6}return e.h=l,e.s=c,e.l=u,e}getRGB(e,t=yt.workingColorSpace){return yt.workingToColorSpace(Hn.copy(this),t),e.r=Hn.r,e.g=Hn.g,e.b=Hn.b,e}getStyle(e=Kn){yt.workingToColorSpace(Hn.copy(this),e);let t=Hn.r,i=Hn.g,s=Hn.b;return e!==Kn?`color(${e} ${t.toFixed(3)} ${i.toFixed(3)} ${s.toFixed(3)})`:`rgb(${Math.round(t*255)},${Math.round(i*255)},${Math.round(s*255)})`}offsetHSL(e,t,i){return this.getHSL(Vs),this.setHSL(Vs.h+e,Vs.s+t,Vs.l+i)}add(e){return this.r+=e.r,this.g+=e.g,this.b+=e.b,this}addColors(e,t){return this.r=e.r+t.r,this.g=e.g+t.g,this.b=e.b+t.b,this}addScalar(e){return this.r+=e,this.g+=e,this.b+=e,this}sub(e){return this.r=Math.max(0,this.r-e.r),this.g=Math.max(0,this.g-e.g),this.b=Math.max(0,this.b-e.b),this}multiply(e){return this.r*=e.r,this.g*=e.g,this.b*=e.b,this}multiplyScalar(e){return this.r*=e,this.g*=e,this.b*=e,this}lerp(e,t){return this.r+=(e.r-this.r)*t,this.g+=(e.g-this.g)*t,this.b+=(e.b-this.b)*t,this}lerpColors(e,t,i){return this.r=e.r+(t.r-e.r)*i,this.g=e.g+(t.g-e.g)*i,this.b=e.b+(t.b-e.b)*i,this}lerpHSL(e,t){this.getHSL(Vs),e.getHSL(bl);let i=oa(Vs.h,bl.h,t),s=oa(Vs.s,bl.s,t),r=oa(Vs.l,bl.l,t);return this.setHSL(i,s,r),this}setFromVector3(e){return this.r=e.x,this.g=e.y,this.b=e.z,this}applyMatrix3(e){let t=this.r,i=this.g,s=this.b,r=e.elements;return this.r=r[0]*t+r[3]*i+r[6]*s,this.g=r[1]*t+r[4]*i+r[7]*s,this.b=r[2]*t+r[5]*i+r[8]*s,this}equals(e){return e.r===this.r&&e.g===this.g&&e.b===this.b}fromArray(e,t=0){return this.r=e[t],this.g=e[t+1],this.b=e[t+2],this}toArray(e=[],t=0){return e[t]=this.r,e[t+1]=this.g,e[t+2]=this.b,e}fromBufferAttribute(e,t){return this.r=e.getX(t),this.g=e.getY(t),this.b=e.getZ(t),this}toJSON(){return this.getHex()}*[Symbol.iterator](){yield this.r,yield this.g,yield this.b}},Hn=new tt;tt.NAMES=mg;var pa=class extends Sn{constructor(){super(),this.isScene=!0,this.type="Scene",this.background=null,this.environment=null,this.fog=null,this.backgroundBlurriness=0,this.backgroundIntensity=1,this.backgroundRotation=new Ms,this.environmentIntensity=1,this.environmentRotation=new Ms,this.overrideMaterial=null,typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}copy(e,t){return super.copy(e,t),this.background=e.background!==null?e.background.clone():null,this.environment=e.environment!==null?e.environment.clone():null,this.fog=e.fog!==null?e.fog.clone():null,this.backgroundBlurriness=e.backgroundBlurriness,this.backgroundIntensity=e.backgroundIntensity,this.backgroundRotation.copy(e.backgroundRotation),this.environmentIntensity=e.environmentIntensity,this.environmentRotation.copy(e.environmentRotation),this.overrideMaterial=e.overrideMaterial!==null?e.overrideMaterial.clone():null,this.matrixAutoUpdate=e.matrixAutoUpdate,this}toJSON(e){let t=super.toJSON(e);return this.fog!==null&&(t.object.fog=this.fog.toJSON()),t.object.backgroundBlurriness=this.backgroundBlurriness,t.object.backgroundIntensity=this.backgroundIntensity,t.object.backgroundRotation=this.backgroundRotation.toArray(),t.object.environmentIntensity=this.environmentIntensity,t.object.environmentRotation=this.environmentRotation.toArray(),t}},Ii=new H,_s=new H,zh=new H,xs=new H,Vr=new H,Gr=new H,dm=new H,Vh=new H,Gh=new H,Hh=new H,Wh=new jt,Xh=new jt,qh=new jt,ji=class n{constructor(e=new H,t=new H,i=new H){this.a=e,this.b=t,this.c=i}static getNormal(e,t,i,s){s.subVectors(i,t),Ii.subVectors(e,t),s.cross(Ii);let r=s.lengthSq();return r>0?s.multiplyScalar(1/Math.sqrt(r)):s.set(0,0,0)}static getBarycoord(e,t,i,s,r){Ii.subVectors(s,t),_s.subVectors(i,t),zh.subVectors(e,t);let o=Ii.dot(Ii),a=Ii.dot(_s),l=Ii.dot(zh),c=_s.dot(_s),u=_s.dot(zh),d=o*c-a*a;if(d===0)return r.set(0,0,0),null;let h=1/d,f=(c*l-a*u)*h,m=(o*u-a*l)*h;return r.set(1-f-m,m,f)}static containsPoint(e,t,i,s){return this.getBarycoord(e,t,i,s,xs)===null?!1:xs.x>=0&&xs.y>=0&&xs.x+xs.y<=1}static getInterpolation(e,t,i,s,r,o,a,l){return this.getBarycoord(e,t,i,s,xs)===null?(l.x=0,l.y=0,"z"in l&&(l.z=0),"w"in l&&(l.w=0),null):(l.setScalar(0),l.addScaledVector(r,xs.x),l.addScaledVector(o,xs.y),l.addScaledVector(a,xs.z),l)}static getInterpolatedAttribute(e,t,i,s,r,o){return Wh.setScalar(0),Xh.setScalar(0),qh.setScalar(0),Wh.fromBufferAttribute(e,t),Xh.fromBufferAttribute(e,i),qh.fromBufferAttribute(e,s),o.setScalar(0),o.addScaledVector(Wh,r.x),o.addScaledVector(Xh,r.y),o.addScaledVector(qh,r.z),o}static isFrontFacing(e,t,i,s){return Ii.subVectors(i,t),_s.subVectors(e,t),Ii.cross(_s).dot(s)<0}set(e,t,i){return this.a.copy(e),this.b.copy(t),this.c.copy(i),this}setFromPointsAndIndices(e,t,i,s){return this.a.copy(e[t]),this.b.copy(e[i]),this.c.copy(e[s]),this}setFromAttributeAndIndices(e,t,i,s){return this.a.fromBufferAttribute(e,t),this.b.fromBufferAttribute(e,i),this.c.fromBufferAttribute(e,s),this}clone(){return new this.constructor().copy(this)}copy(e){return this.a.copy(e.a),this.b.copy(e.b),this.c.copy(e.c),this}getArea(){return Ii.subVectors(this.c,this.b),_s.subVectors(this.a,this.b),Ii.cross(_s).length()*.5}getMidpoint(e){return e.addVectors(this.a,this.b).add(this.c).multiplyScalar(1/3)}getNormal(e){return n.getNormal(this.a,this.b,this.c,e)}getPlane(e){return e.setFromCoplanarPoints(this.a,this.b,this.c)}getBarycoord(e,t){return n.getBarycoord(e,this.a,this.b,this.c,t)}getInterpolation(e,t,i,s,r){return n.getInterpolation(e,this.a,this.b,this.c,t,i,s,r)}containsPoint(e){return n.containsPoint(e,this.a,this.b,this.c)}isFrontFacing(e){return n.isFrontFacing(this.a,this.b,this.c,e)}intersectsBox(e){return e.intersectsTriangle(this)}closestPointToPoint(e,t){let i=this.a,s=this.b,r=this.c,o,a;Vr.subVectors(s,i),Gr.subVectors(r,i),Vh.subVectors(e,i);let l=Vr.dot(Vh),c=Gr.dot(Vh);if(l<=0&&c<=0)return t.copy(i);Gh.subVectors(e,s);let u=Vr.dot(Gh),d=Gr.dot(Gh);if(u>=0&&d<=u)return t.copy(s);let h=l*d-u*c;if(h<=0&&l>=0&&u<=0&&l-u>0)return o=l/(l-u),t.copy(i).addScaledVector(Vr,o);Hh.subVectors(e,r);let f=Vr.dot(Hh),m=Gr.dot(Hh);if(m>=0&&f<=m)return t.copy(r);let y=f*c-l*m;if(y<=0&&c>=0&&m<=0)return a=c/(c-m),t.copy(i).addScaledVector(Gr,a);let g=u*m-f*d;if(g<=0&&d-u>=0&&f-m>=0)return dm.subVectors(r,s),a=(d-u)/(d-u+(f-m)),t.copy(s).addScaledVector(dm,a);let _=1/(g+y+h);return o=y*_,a=h*_,t.copy(i).addScaledVector(Vr,o).addScaledVector(Gr,a)}equals(e){return e.a.equals(this.a)&&e.b.equals(this.b)&&e.c.equals(this.c)}},kn=class{constructor(e=new H(1/0,1/0,1/0),t=new H(-1/0,-1/0,-1/0)){this.isBox3=!0,this.min=e,this.max=t}set(e,t){return this.min.copy(e),this.max.copy(t),this}setFromArray(e){this.makeEmpty();for(let t=0,i=e.length;t<i;t+=3)this.expandByPoint(Li.fromArray(e,t));return this}setFromBufferAttribute(e){this.makeEmpty();for(let t=0,i=e.count;t<i;t++)this.expandByPoint(Li.fromBufferAttribute(e,t));return this}setFromPoints(e){this.makeEmpty();for(let t=0,i=e.length;t<i;t++)this.expandByPoint(e[t]);return this}setFromCenterAndSize(e,t){let i=Li.copy(t).multiplyScalar(.5);return this.min.copy(e).sub(i),this.max.copy(e).add(i),this}setFromObject(e,t=!1){return this.makeEmpty(),this.expandByObject(e,t)}clone(){return new this.constructor().copy(this)}copy(e){return this.min.copy(e.min),this.max.copy(e.max),this}makeEmpty(){return this.min.x=this.min.y=this.min.z=1/0,this.max.x=this.max.y=this.max.z=-1/0,this}isEmpty(){return this.max.x<this.min.x||this.max.y<this.min.y||this.max.z<this.min.z}getCenter(e){return this.isEmpty()?e.set(0,0,0):e.addVectors(this.min,this.max).multiplyScalar(.5)}getSize(e){return this.isEmpty()?e.set(0,0,0):e.subVectors(this.max,this.min)}expandByPoint(e){return this.min.min(e),this.max.max(e),this}expandByVector(e){return this.min.sub(e),this.max.add(e),this}expandByScalar(e){return this.min.addScalar(-e),this.max.addScalar(e),this}expandByObject(e,t=!1){e.updateWorldMatrix(!1,!1);let i=e.geometry;if(i!==void 0){let r=i.getAttribute("position");if(t===!0&&r!==void 0&&e.isInstancedMesh!==!0&&e.isBatchedMesh!==!0)for(let o=0,a=r.count;o<a;o++)e.isMesh===!0?e.getVertexPosition(o,Li):Li.fromBufferAttribute(r,o),Li.applyMatrix4(e.matrixWorld),this.expandByPoint(Li);else e.boundingBox!==void 0?(e.boundingBox===null&&e.computeBoundingBox(),Sl.copy(e.boundingBox)):(i.boundingBox===null&&i.computeBoundingBox(),Sl.copy(i.boundingBox)),Sl.applyMatrix4(e.matrixWorld),this.union(Sl)}let s=e.children;for(let r=0,o=s.length;r<o;r++)this.expandByObject(s[r],t);return this}containsPoint(e){return e.x>=this.min.x&&e.x<=this.max.x&&e.y>=this.min.y&&e.y<=this.max.y&&e.z>=this.min.z&&e.z<=this.max.z}containsBox(e){return this.min.x<=e.min.x&&e.max.x<=this.max.x&&this.min.y<=e.min.y&&e.max.y<=this.max.y&&this.min.z<=e.min.z&&e.max.z<=this.max.z}getParameter(e,t){return t.set((e.x-this.min.x)/(this.max.x-this.min.x),(e.y-this.min.y)/(this.max.y-this.min.y),(e.z-this.min.z)/(this.max.z-this.min.z))}intersectsBox(e){return e.max.x>=this.min.x&&e.min.x<=this.max.x&&e.max.y>=this.min.y&&e.min.y<=this.max.y&&e.max.z>=this.min.z&&e.min.z<=this.max.z}intersectsSphere(e){return this.clampPoint(e.center,Li),Li.distanceToSquared(e.center)<=e.radius*e.radius}intersectsPlane(e){let t,i;return e.normal.x>0?(t=e.normal.x*this.min.x,i=e.normal.x*this.max.x):(t=e.normal.x*this.max.x,i=e.normal.x*this.min.x),e.normal.y>0?(t+=e.normal.y*this.min.y,i+=e.normal.y*this.max.y):(t+=e.normal.y*this.max.y,i+=e.normal.y*this.min.y),e.normal.z>0?(t+=e.normal.z*this.min.z,i+=e.normal.z*this.max.z):(t+=e.normal.z*this.max.z,i+=e.normal.z*this.min.z),t<=-e.constant&&i>=-e.constant}intersectsTriangle(e){if(this.isEmpty())return!1;this.getCenter(jo),Ml.subVectors(this.max,jo),Hr.subVectors(e.a,jo),Wr.subVectors(e.b,jo),Xr.subVectors(e.c,jo),Gs.subVectors(Wr,Hr),Hs.subVectors(Xr,Wr),ur.subVectors(Hr,Xr);let t=[0,-Gs.z,Gs.y,0,-Hs.z,Hs.y,0,-ur.z,ur.y,Gs.z,0,-Gs.x,Hs.z,0,-Hs.x,ur.z,0,-ur.x,-Gs.y,Gs.x,0,-Hs.y,Hs.x,0,-ur.y,ur.x,0];return!Yh(t,Hr,Wr,Xr,Ml)||(t=[1,0,0,0,1,0,0,0,1],!Yh(t,Hr,Wr,Xr,Ml))?!1:(wl.crossVectors(Gs,Hs),t=[wl.x,wl.y,wl.z],Yh(t,Hr,Wr,Xr,Ml))}clampPoint(e,t){return t.copy(e).clamp(this.min,this.max)}distanceToPoint(e){return this.clampPoint(e,Li).distanceTo(e)}getBoundingSphere(e){return this.isEmpty()?e.makeEmpty():(this.getCenter(e.center),e.radius=this.getSize(Li).length()*.5),e}intersect(e){return this.min.max(e.min),this.max.min(e.max),this.isEmpty()&&this.makeEmpty(),this}union(e){return this.min.min(e.min),this.max.max(e.max),this}applyMatrix4(e){return this.isEmpty()?this:(vs[0].set(this.min.x,this.min.y,this.min.z).applyMatrix4(e),vs[1].set(this.min.x,this.min.y,this.max.z).applyMatrix4(e),vs[2].set(this.min.x,this.max.y,this.min.z).applyMatrix4(e),vs[3].set(this.min.x,this.max.y,this.max.z).applyMatrix4(e),vs[4].set(this.max.x,this.min.y,this.min.z).applyMatrix4(e),vs[5].set(this.max.x,this.min.y,this.max.z).applyMatrix4(e),vs[6].set(this.max.x,this.max.y,this.min.z).applyMatrix4(e),vs[7].set(this.max.x,this.max.y,this.max.z).applyMatrix4(e),this.setFromPoints(vs),this)}translate(e){return this.min.add(e),this.max.add(e),this}equals(e){return e.min.equals(this.min)&&e.max.equals(this.max)}toJSON(){return{min:this.min.toArray(),max:this.max.toArray()}}fromJSON(e){return this.min.fromArray(e.min),this.max.fromArray(e.max),this}},vs=[new H,new H,new H,new H,new H,new H,new H,new H],Li=new H,Sl=new kn,Hr=new H,Wr=new H,Xr=new H,Gs=new H,Hs=new H,ur=new H,jo=new H,Ml=new H,wl=new H,hr=new H;function Yh(n,e,t,i,s){for(let r=0,o=n.length-3;r<=o;r+=3){hr.fromArray(n,r);let a=s.x*Math.abs(hr.x)+s.y*Math.abs(hr.y)+s.z*Math.abs(hr.z),l=e.dot(hr),c=t.dot(hr),u=i.dot(hr);if(Math.max(-Math.max(l,c,u),Math.min(l,c,u))>a)return!1}return!0}var _n=new H,Tl=new qe,Ev=0,Ni=class extends Ui{constructor(e,t,i=!1){if(super(),Array.isArray(e))throw new TypeError("THREE.BufferAttribute: array should be a Typed Array.");this.isBufferAttribute=!0,Object.defineProperty(this,"id",{value:Ev++}),this.name="",this.array=e,this.itemSize=t,this.count=e!==void 0?e.length/t:0,this.normalized=i,this.usage=Od,this.updateRanges=[],this.gpuType=ki,this.version=0,this._normalizationScale=e!==void 0?_u(e):void 0}onUploadCallback(){}set needsUpdate(e){e===!0&&this.version++}setUsage(e){return this.usage=e,this}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}copy(e){return this.name=e.name,this.array=new e.array.constructor(e.array),this.itemSize=e.itemSize,this.count=e.count,this.normalized=e.normalized,this.usage=e.usage,this.gpuType=e.gpuType,this._normalizationScale=e._normalizationScale,this}copyAt(e,t,i){e*=this.itemSize,i*=t.itemSize;for(let s=0,r=this.itemSize;s<r;s++)this.array[e+s]=t.array[i+s];return this}copyArray(e){return this.array.set(e),this}applyMatrix3(e){if(this.itemSize===2)for(let t=0,i=this.count;t<i;t++)Tl.fromBufferAttribute(this,t),Tl.applyMatrix3(e),this.setXY(t,Tl.x,Tl.y);else if(this.itemSize===3)for(let t=0,i=this.count;t<i;t++)_n.fromBufferAttribute(this,t),_n.applyMatrix3(e),this.setXYZ(t,_n.x,_n.y,_n.z);return this}applyMatrix4(e){for(let t=0,i=this.count;t<i;t++)_n.fromBufferAttribute(this,t),_n.applyMatrix4(e),this.setXYZ(t,_n.x,_n.y,_n.z);return this}applyNormalMatrix(e){for(let t=0,i=this.count;t<i;t++)_n.fromBufferAttribute(this,t),_n.applyNormalMatrix(e),this.setXYZ(t,_n.x,_n.y,_n.z);return this}transformDirection(e){for(let t=0,i=this.count;t<i;t++)_n.fromBufferAttribute(this,t),_n.transformDirection(e),this.setXYZ(t,_n.x,_n.y,_n.z);return this}set(e,t=0){return this.array.set(e,t),this}getComponent(e,t){let i=this.array[e*this.itemSize+t];return this.normalized&&(i=this._denormalize(i)),i}setComponent(e,t,i){return this.normalized&&(i=this._normalize(i)),this.array[e*this.itemSize+t]=i,this}getX(e){let t=this.array[e*this.itemSize];return this.normalized&&(t=this._denormalize(t)),t}setX(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize]=t,this}getY(e){let t=this.array[e*this.itemSize+1];return this.normalized&&(t=this._denormalize(t)),t}setY(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+1]=t,this}getZ(e){let t=this.array[e*this.itemSize+2];return this.normalized&&(t=this._denormalize(t)),t}setZ(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+2]=t,this}getW(e){let t=this.array[e*this.itemSize+3];return this.normalized&&(t=this._denormalize(t)),t}setW(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+3]=t,this}setXY(e,t,i){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i)),this.array[e+0]=t,this.array[e+1]=i,this}setXYZ(e,t,i,s){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s)),this.array[e+0]=t,this.array[e+1]=i,this.array[e+2]=s,this}setXYZW(e,t,i,s,r){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s),r=this._normalize(r)),this.array[e+0]=t,this.array[e+1]=i,this.array[e+2]=s,this.array[e+3]=r,this}onUpload(e){return this.onUploadCallback=e,this}clone(){return new this.constructor(this.array,this.itemSize).copy(this)}toJSON(){let e={itemSize:this.itemSize,type:this.array.constructor.name,array:Array.from(this.array),normalized:this.normalized};return e.name=this.name,e.usage=this.usage,e.gpuType=this.gpuType,e}dispose(){this.dispatchEvent({type:"dispose"})}_denormalize(e){let t=this._normalizationScale;return t!==void 0?Math.max(e/t,-1):zd(e,this.array)}_normalize(e){let t=this._normalizationScale;return t!==void 0?Math.round(e*t):Vd(e,this.array)}};var ma=class extends Ni{constructor(e,t,i){super(new Uint16Array(e),t,i)}};var ga=class extends Ni{constructor(e,t,i){super(new Uint32Array(e),t,i)}};var en=class extends Ni{constructor(e,t,i){super(new Float32Array(e),t,i)}},Av=new kn,Qo=new H,$h=new H,Xs=class{constructor(e=new H,t=-1){this.isSphere=!0,this.center=e,this.radius=t}set(e,t){return this.center.copy(e),this.radius=t,this}setFromPoints(e,t){let i=this.center;t!==void 0?i.copy(t):Av.setFromPoints(e).getCenter(i);let s=0;for(let r=0,o=e.length;r<o;r++)s=Math.max(s,i.distanceToSquared(e[r]));return this.radius=Math.sqrt(s),this}copy(e){return this.center.copy(e.center),this.radius=e.radius,this}isEmpty(){return this.radius<0}makeEmpty(){return this.center.set(0,0,0),this.radius=-1,this}containsPoint(e){return e.distanceToSquared(this.center)<=this.radius*this.radius}distanceToPoint(e){return e.distanceTo(this.center)-this.radius}intersectsSphere(e){let t=this.radius+e.radius;return e.center.distanceToSquared(this.center)<=t*t}intersectsBox(e){return e.intersectsSphere(this)}intersectsPlane(e){return Math.abs(e.distanceToPoint(this.center))<=this.radius}clampPoint(e,t){let i=this.center.distanceToSquared(e);return t.copy(e),i>this.radius*this.radius&&(t.sub(this.center).normalize(),t.multiplyScalar(this.radius).add(this.center)),t}getBoundingBox(e){return this.isEmpty()?(e.makeEmpty(),e):(e.set(this.center,this.center),e.expandByScalar(this.radius),e)}applyMatrix4(e){return this.center.applyMatrix4(e),this.radius=this.radius*e.getMaxScaleOnAxis(),this}translate(e){return this.center.add(e),this}expandByPoint(e){if(this.isEmpty())return this.center.copy(e),this.radius=0,this;Qo.subVectors(e,this.center);let t=Qo.lengthSq();if(t>this.radius*this.radius){let i=Math.sqrt(t),s=(i-this.radius)*.5;this.center.addScaledVector(Qo,s/i),this.radius+=s}return this}union(e){return e.isEmpty()?this:this.isEmpty()?(this.copy(e),this):(this.center.equals(e.center)===!0?this.radius=Math.max(this.radius,e.radius):($h.subVectors(e.center,this.center).setLength(e.radius),this.expandByPoint(Qo.copy(e.center).add($h)),this.expandByPoint(Qo.copy(e.center).sub($h))),this)}equals(e){return e.center.equals(this.center)&&e.radius===this.radius}clone(){return new this.constructor().copy(this)}toJSON(){return{radius:this.radius,center:this.center.toArray()}}fromJSON(e){return this.radius=e.radius,this.center.fromArray(e.center),this}},Cv=0,Si=new Bt,Zh=new Sn,qr=new H,fi=new kn,ea=new kn,Dn=new H,Bn=class n extends Ui{constructor(){super(),this.isBufferGeometry=!0,Object.defineProperty(this,"id",{value:Cv++}),this.uuid=tr(),this.name="",this.type="BufferGeometry",this.index=null,this.indirect=null,this.indirectOffset=0,this.attributes={},this.morphAttributes={},this.morphTargetsRelative=!1,this.groups=[],this.boundingBox=null,this.boundingSphere=null,this.drawRange={start:0,count:1/0},this.userData={},this._transformed=!1}getIndex(){return this.index}setIndex(e){return Array.isArray(e)?this.index=new(Qx(e)?ga:ma)(e,1):this.index=e,this}setIndirect(e,t=0){return this.indirect=e,this.indirectOffset=t,this}getIndirect(){return this.indirect}getAttribute(e){return this.attributes[e]}setAttribute(e,t){return this.attributes[e]=t,this}deleteAttribute(e){return delete this.attributes[e],this}hasAttribute(e){return this.attributes[e]!==void 0}addGroup(e,t,i=0){this.groups.push({start:e,count:t,materialIndex:i})}clearGroups(){this.groups=[]}setDrawRange(e,t){this.drawRange.start=e,this.drawRange.count=t}applyMatrix4(e){let t=this.attributes.position;t!==void 0&&(t.applyMatrix4(e),t.needsUpdate=!0);let i=this.attributes.normal;if(i!==void 0){let r=new nt().getNormalMatrix(e);i.applyNormalMatrix(r),i.needsUpdate=!0}let s=this.attributes.tangent;return s!==void 0&&(s.transformDirection(e),s.needsUpdate=!0),this.boundingBox!==null&&this.computeBoundingBox(),this.boundingSphere!==null&&this.computeBoundingSphere(),this._transformed=!0,this}applyQuaternion(e){return Si.makeRotationFromQuaternion(e),this.applyMatrix4(Si),this}rotateX(e){return Si.makeRotationX(e),this.applyMatrix4(Si),this}rotateY(e){return Si.makeRotationY(e),this.applyMatrix4(Si),this}rotateZ(e){return Si.makeRotationZ(e),this.applyMatrix4(Si),this}translate(e,t,i){return Si.makeTranslation(e,t,i),this.applyMatrix4(Si),this}scale(e,t,i){return Si.makeScale(e,t,i),this.applyMatrix4(Si),this}lookAt(e){return Zh.lookAt(e),Zh.updateMatrix(),this.applyMatrix4(Zh.matrix),this}center(){return this.computeBoundingBox(),this.boundingBox.getCenter(qr).negate(),this.translate(qr.x,qr.y,qr.z),this}setFromPoints(e){let t=this.getAttribute("position");if(t===void 0){let i=[];for(let s=0,r=e.length;s<r;s++){let o=e[s];i.push(o.x,o.y,o.z||0)}this.setAttribute("position",new en(i,3))}else{let i=Math.min(e.length,t.count);for(let s=0;s<i;s++){let r=e[s];t.setXYZ(s,r.x,r.y,r.z||0)}e.length>t.count&&$e("BufferGeometry: Buffer size too small for points data. Use .dispose() and create a new geometry."),t.needsUpdate=!0}return this}computeBoundingBox(){this.boundingBox===null&&(this.boundingBox=new kn);let e=this.attributes.position,t=this.morphAttributes.position;if(e&&e.isGLBufferAttribute){Qe("BufferGeometry.computeBoundingBox(): GLBufferAttribute requires a manual bounding box.",this),this.boundingBox.set(new H(-1/0,-1/0,-1/0),new H(1/0,1/0,1/0));return}if(e!==void 0){if(this.boundingBox.setFromBufferAttribute(e),t)for(let i=0,s=t.length;i<s;i++){let r=t[i];fi.setFromBufferAttribute(r),this.morphTargetsRelative?(Dn.addVectors(this.boundingBox.min,fi.min),this.boundingBox.expandByPoint(Dn),Dn.addVectors(this.boundingBox.max,fi.max),this.boundingBox.expandByPoint(Dn)):(this.boundingBox.expandByPoint(fi.min),this.boundingBox.expandByPoint(fi.max))}}else this.boundingBox.makeEmpty();(isNaN(this.boundingBox.min.x)||isNaN(this.boundingBox.min.y)||isNaN(this.boundingBox.min.z))&&Qe('BufferGeometry.computeBoundingBox(): Computed min/max have NaN values. The "position" attribute is likely to have NaN values.',this)}computeBoundingSphere(){this.boundingSphere===null&&(this.boundingSphere=new Xs);let e=this.attributes.position,t=this.morphAttributes.position;if(e&&e.isGLBufferAttribute){Qe("BufferGeometry.computeBoundingSphere(): GLBufferAttribute requires a manual bounding sphere.",this),this.boundingSphere.set(new H,1/0);return}if(e){let i=this.boundingSphere.center;if(fi.setFromBufferAttribute(e),t)for(let r=0,o=t.length;r<o;r++){let a=t[r];ea.setFromBufferAttribute(a),this.morphTargetsRelative?(Dn.addVectors(fi.min,ea.min),fi.expandByPoint(Dn),Dn.addVectors(fi.max,ea.max),fi.expandByPoint(Dn)):(fi.expandByPoint(ea.min),fi.expandByPoint(ea.max))}fi.getCenter(i);let s=0;for(let r=0,o=e.count;r<o;r++)Dn.fromBufferAttribute(e,r),s=Math.max(s,i.distanceToSquared(Dn));if(t)for(let r=0,o=t.length;r<o;r++){let a=t[r],l=this.morphTargetsRelative;for(let c=0,u=a.count;c<u;c++)Dn.fromBufferAttribute(a,c),l&&(qr.fromBufferAttribute(e,c),Dn.add(qr)),s=Math.max(s,i.distanceToSquared(Dn))}this.boundingSphere.radius=Math.sqrt(s),isNaN(this.boundingSphere.radius)&&Qe('BufferGeometry.computeBoundingSphere(): Computed radius is NaN. The "position" attribute is likely to have NaN values.',this)}}computeTangents(){let e=this.index,t=this.attributes;if(e===null||t.position===void 0||t.normal===void 0||t.uv===void 0){Qe("BufferGeometry: .computeTangents() failed. Missing required attributes (index, position, normal or uv)");return}let i=t.position,s=t.normal,r=t.uv,o=this.getAttribute("tangent");(o===void 0||o.count!==i.count)&&(o=new Ni(new Float32Array(4*i.count),4),this.setAttribute("tangent",o));let a=[],l=[],c=new Uint8Array(i.count);for(let F=0;F<i.count;F++)a[F]=new H,l[F]=new H;let u=new H,d=new H,h=new H,f=new qe,m=new qe,y=new qe,g=new H,_=new H;function b(F,D,L){c[F]=c[D]=c[L]=1,u.fromBufferAttribute(i,F),d.fromBufferAttribute(i,D),h.fromBufferAttribute(i,L),f.fromBufferAttribute(r,F),m.fromBufferAttribute(r,D),y.fromBufferAttribute(r,L),d.sub(u),h.sub(u),m.sub(f),y.sub(f);let B=1/(m.x*y.y-y.x*m.y);isFinite(B)&&(g.copy(d).multiplyScalar(y.y).addScaledVector(h,-m.y).multiplyScalar(B),_.copy(h).multiplyScalar(m.x).addScaledVector(d,-y.x).multiplyScalar(B),a[F].add(g),a[D].add(g),a[L].add(g),l[F].add(_),l[D].add(_),l[L].add(_))}let C=this.groups;C.length===0&&(C=[{start:0,count:e.count}]);for(let F=0,D=C.length;F<D;++F){let L=C[F],B=L.start,V=L.count;for(let U=B,X=B+V;U<X;U+=3)b(e.getX(U+0),e.getX(U+1),e.getX(U+2))}let S=new H,P=new H,A=new H,x=new H;function w(F){A.fromBufferAttribute(s,F),x.copy(A);let D=a[F];S.copy(D),S.sub(A.multiplyScalar(A.dot(D))).normalize(),P.crossVectors(x,D);let B=P.dot(l[F])<0?-1:1;o.setXYZW(F,S.x,S.y,S.z,B)}for(let F=0,D=i.count;F<D;++F)c[F]&&w(F);this._transformed=!0}computeVertexNormals(){let e=this.index,t=this.getAttribute("position");if(t!==void 0){let i=this.getAttribute("normal");if(i===void 0||i.count!==t.count)i=new Ni(new Float32Array(t.count*3),3),this.setAttribute("normal",i);else for(let h=0,f=i.count;h<f;h++)i.setXYZ(h,0,0,0);let s=new H,r=new H,o=new H,a=new H,l=new H,c=new H,u=new H,d=new H;if(e)for(let h=0,f=e.count;h<f;h+=3){let m=e.getX(h+0),y=e.getX(h+1),g=e.getX(h+2);s.fromBufferAttribute(t,m),r.fromBufferAttribute(t,y),o.fromBufferAttribute(t,g),u.subVectors(o,r),d.subVectors(s,r),u.cross(d),a.fromBufferAttribute(i,m),l.fromBufferAttribute(i,y),c.fromBufferAttribute(i,g),a.add(u),l.add(u),c.add(u),i.setXYZ(m,a.x,a.y,a.z),i.setXYZ(y,l.x,l.y,l.z),i.setXYZ(g,c.x,c.y,c.z)}else for(let h=0,f=t.count;h<f;h+=3)s.fromBufferAttribute(t,h+0),r.fromBufferAttribute(t,h+1),o.fromBufferAttribute(t,h+2),u.subVectors(o,r),d.subVectors(s,r),u.cross(d),i.setXYZ(h+0,u.x,u.y,u.z),i.setXYZ(h+1,u.x,u.y,u.z),i.setXYZ(h+2,u.x,u.y,u.z);this.normalizeNormals(),i.needsUpdate=!0}}normalizeNormals(){let e=this.attributes.normal;for(let t=0,i=e.count;t<i;t++)Dn.fromBufferAttribute(e,t),Dn.normalize(),e.setXYZ(t,Dn.x,Dn.y,Dn.z)}toNonIndexed(){function e(a,l){let c=a.array,u=a.itemSize,d=a.normalized,h=new c.constructor(l.length*u),f=0,m=0;for(let y=0,g=l.length;y<g;y++){a.isInterleavedBufferAttribute?f=l[y]*a.data.stride+a.offset:f=l[y]*u;for(let _=0;_<u;_++)h[m++]=c[f++]}return new Ni(h,u,d)}if(this.index===null)return $e("BufferGeometry.toNonIndexed(): BufferGeometry is already non-indexed."),this;let t=new n,i=this.index.array,s=this.attributes;for(let a in s){let l=s[a],c=e(l,i);t.setAttribute(a,c)}let r=this.morphAttributes;for(let a in r){let l=[],c=r[a];for(let u=0,d=c.length;u<d;u++){let h=c[u],f=e(h,i);l.push(f)}t.morphAttributes[a]=l}t.morphTargetsRelative=this.morphTargetsRelative;let o=this.groups;for(let a=0,l=o.length;a<l;a++){let c=o[a];t.addGroup(c.start,c.count,c.materialIndex)}return t}toJSON(){let e={metadata:{version:4.7,type:"BufferGeometry",generator:"BufferGeometry.toJSON"}};if(e.uuid=this.uuid,e.type=this.parameters!==void 0&&this._transformed===!0?"BufferGeometry":this.type,e.name=this.name,Object.keys(this.userData).length>0&&(e.userData=this.userData),this.parameters!==void 0&&this._transformed!==!0){let l=this.parameters;for(let c in l)l[c]!==void 0&&(e[c]=l[c]);return e}e.data={attributes:{}};let t=this.index;t!==null&&(e.data.index={type:t.array.constructor.name,array:Array.prototype.slice.call(t.array)});let i=this.attributes;for(let l in i){let c=i[l];e.data.attributes[l]=c.toJSON(e.data)}let s={},r=!1;for(let l in this.morphAttributes){let c=this.morphAttributes[l],u=[];for(let d=0,h=c.length;d<h;d++){let f=c[d];u.push(f.toJSON(e.data))}u.length>0&&(s[l]=u,r=!0)}r&&(e.data.morphAttributes=s,e.data.morphTargetsRelative=this.morphTargetsRelative);let o=this.groups;o.length>0&&(e.data.groups=JSON.parse(JSON.stringify(o)));let a=this.boundingSphere;return a!==null&&(e.data.boundingSphere=a.toJSON()),e}clone(){return new this.constructor().copy(this)}copy(e){this.index=null,this.attributes={},this.morphAttributes={},this.groups=[],this.boundingBox=null,this.boundingSphere=null;let t={};this.name=e.name;let i=e.index;i!==null&&this.setIndex(i.clone());let s=e.attributes;for(let c in s){let u=s[c];this.setAttribute(c,u.clone(t))}let r=e.morphAttributes;for(let c in r){let u=[],d=r[c];for(let h=0,f=d.length;h<f;h++)u.push(d[h].clone(t));this.morphAttributes[c]=u}this.morphTargetsRelative=e.morphTargetsRelative;let o=e.groups;for(let c=0,u=o.length;c<u;c++){let d=o[c];this.addGroup(d.start,d.count,d.materialIndex)}let a=e.boundingBox;a!==null&&(this.boundingBox=a.clone());let l=e.boundingSphere;return l!==null&&(this.boundingSphere=l.clone()),this.drawRange.start=e.drawRange.start,this.drawRange.count=e.drawRange.count,this.userData=e.userData,this._transformed=e._transformed,this}dispose(){this.dispatchEvent({type:"dispose"})}},uc=class{constructor(e,t){this.isInterleavedBuffer=!0,this.array=e,this.stride=t,this.count=e!==void 0?e.length/t:0,this.usage=Od,this.updateRanges=[],this.version=0,this.uuid=tr()}onUploadCallback(){}set needsUpdate(e){e===!0&&this.version++}setUsage(e){return this.usage=e,this}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}copy(e){return this.array=new e.array.constructor(e.array),this.count=e.count,this.stride=e.stride,this.usage=e.usage,this}copyAt(e,t,i){e*=this.stride,i*=t.stride;for(let s=0,r=this.stride;s<r;s++)this.array[e+s]=t.array[i+s];return this}set(e,t=0){return this.array.set(e,t),this}clone(e){e.arrayBuffers===void 0&&(e.arrayBuffers={});let t=fm(this.array);e.arrayBuffers[t]===void 0&&(e.arrayBuffers[t]=this.array.slice(0).buffer);let i=new this.array.constructor(e.arrayBuffers[t]),s=new this.constructor(i,this.stride);return s.setUsage(this.usage),s}onUpload(e){return this.onUploadCallback=e,this}toJSON(e){e.arrayBuffers===void 0&&(e.arrayBuffers={});let t=fm(this.array);e.arrayBuffers[t]===void 0&&(e.arrayBuffers[t]=Array.from(new Uint32Array(this.array.slice(0).buffer)));let i={uuid:this.uuid,buffer:t,type:this.array.constructor.name,stride:this.stride};return i.usage=this.usage,i}};function fm(n){return n.buffer._uuid===void 0&&(n.buffer._uuid=tr()),n.byteOffset===0&&n.byteLength===n.buffer.byteLength?n.buffer._uuid:n.buffer._uuid+":"+n.byteOffset+":"+n.byteLength}var Jn=new H,_a=class n{constructor(e,t,i,s=!1){this.isInterleavedBufferAttribute=!0,this.name="",this.data=e,this.itemSize=t,this.offset=i,this.normalized=s,this._normalizationScale=e!==void 0?_u(e.array):void 0}get count(){return this.data.count}get array(){return this.data.array}set needsUpdate(e){this.data.needsUpdate=e}applyMatrix4(e){for(let t=0,i=this.data.count;t<i;t++)Jn.fromBufferAttribute(this,t),Jn.applyMatrix4(e),this.setXYZ(t,Jn.x,Jn.y,Jn.z);return this}applyNormalMatrix(e){for(let t=0,i=this.count;t<i;t++)Jn.fromBufferAttribute(this,t),Jn.applyNormalMatrix(e),this.setXYZ(t,Jn.x,Jn.y,Jn.z);return this}transformDirection(e){for(let t=0,i=this.count;t<i;t++)Jn.fromBufferAttribute(this,t),Jn.transformDirection(e),this.setXYZ(t,Jn.x,Jn.y,Jn.z);return this}getComponent(e,t){let i=this.array[e*this.data.stride+this.offset+t];return this.normalized&&(i=this._denormalize(i)),i}setComponent(e,t,i){return this.normalized&&(i=this._normalize(i)),this.data.array[e*this.data.stride+this.offset+t]=i,this}setX(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset]=t,this}setY(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+1]=t,this}setZ(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+2]=t,this}setW(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+3]=t,this}getX(e){let t=this.data.array[e*this.data.stride+this.offset];return this.normalized&&(t=this._denormalize(t)),t}getY(e){let t=this.data.array[e*this.data.stride+this.offset+1];return this.normalized&&(t=this._denormalize(t)),t}getZ(e){let t=this.data.array[e*this.data.stride+this.offset+2];return this.normalized&&(t=this._denormalize(t)),t}getW(e){let t=this.data.array[e*this.data.stride+this.offset+3];return this.normalized&&(t=this._denormalize(t)),t}setXY(e,t,i){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),i=this._normalize(i)),this.data.array[e+0]=t,this.data.array[e+1]=i,this}setXYZ(e,t,i,s){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s)),this.data.array[e+0]=t,this.data.array[e+1]=i,this.data.array[e+2]=s,this}setXYZW(e,t,i,s,r){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s),r=this._normalize(r)),this.data.array[e+0]=t,this.data.array[e+1]=i,this.data.array[e+2]=s,this.data.array[e+3]=r,this}clone(e){if(e===void 0){ha("InterleavedBufferAttribute.clone(): Cloning an interleaved buffer attribute will de-interleave buffer data.");let t=[];for(let i=0;i<this.count;i++){let s=i*this.data.stride+this.offset;for(let r=0;r<this.itemSize;r++)t.push(this.data.array[s+r])}return new Ni(new this.array.constructor(t),this.itemSize,this.normalized)}else return e.interleavedBuffers===void 0&&(e.interleavedBuffers={}),e.interleavedBuffers[this.data.uuid]===void 0&&(e.interleavedBuffers[this.data.uuid]=this.data.clone(e)),new n(e.interleavedBuffers[this.data.uuid],this.itemSize,this.offset,this.normalized)}toJSON(e){if(e===void 0){ha("InterleavedBufferAttribute.toJSON(): Serializing an interleaved buffer attribute will de-interleave buffer data.");let t=[];for(let i=0;i<this.count;i++){let s=i*this.data.stride+this.offset;for(let r=0;r<this.itemSize;r++)t.push(this.data.array[s+r])}return{itemSize:this.itemSize,type:this.array.constructor.name,array:t,normalized:this.normalized}}else return e.interleavedBuffers===void 0&&(e.interleavedBuffers={}),e.interleavedBuffers[this.data.uuid]===void 0&&(e.interleavedBuffers[this.data.uuid]=this.data.toJSON(e)),{isInterleavedBufferAttribute:!0,itemSize:this.itemSize,data:this.data.uuid,offset:this.offset,normalized:this.normalized}}_denormalize(e){let t=this._normalizationScale;return t!==void 0?Math.max(e/t,-1):zd(e,this.data.array)}_normalize(e){let t=this._normalizationScale;return t!==void 0?Math.round(e*t):Vd(e,this.data.array)}},Jh=new H,Rv=new H,Pv=new nt,pi=class{constructor(e=new H(1,0,0),t=0){this.isPlane=!0,this.normal=e,this.constant=t}set(e,t){return this.normal.copy(e),this.constant=t,this}setComponents(e,t,i,s){return this.normal.set(e,t,i),this.constant=s,this}setFromNormalAndCoplanarPoint(e,t){return this.normal.copy(e),this.constant=-t.dot(this.normal),this}setFromCoplanarPoints(e,t,i){let s=Jh.subVectors(i,t).cross(Rv.subVectors(e,t)).normalize();return this.setFromNormalAndCoplanarPoint(s,e),this}copy(e){return this.normal.copy(e.normal),this.constant=e.constant,this}normalize(){let e=1/this.normal.length();return this.normal.multiplyScalar(e),this.constant*=e,this}negate(){return this.constant*=-1,this.normal.negate(),this}distanceToPoint(e){return this.normal.dot(e)+this.constant}distanceToSphere(e){return this.distanceToPoint(e.center)-e.radius}projectPoint(e,t){return t.copy(e).addScaledVector(this.normal,-this.distanceToPoint(e))}intersectLine(e,t,i=!0){let s=e.delta(Jh),r=this.normal.dot(s);if(r===0)return this.distanceToPoint(e.start)===0?t.copy(e.start):null;let o=-(e.start.dot(this.normal)+this.constant)/r;return i===!0&&(o<0||o>1)?null:t.copy(e.start).addScaledVector(s,o)}intersectsLine(e){let t=this.distanceToPoint(e.start),i=this.distanceToPoint(e.end);return t<0&&i>0||i<0&&t>0}intersectsBox(e){return e.intersectsPlane(this)}intersectsSphere(e){return e.intersectsPlane(this)}coplanarPoint(e){return e.copy(this.normal).multiplyScalar(-this.constant)}applyMatrix4(e,t){let i=t||Pv.getNormalMatrix(e),s=this.coplanarPoint(Jh).applyMatrix4(e),r=this.normal.applyMatrix3(i).normalize();return this.constant=-s.dot(r),this}translate(e){return this.constant-=e.dot(this.normal),this}equals(e){return e.normal.equals(this.normal)&&e.constant===this.constant}clone(){return new this.constructor().copy(this)}toJSON(){return{normal:this.normal.toArray(),constant:this.constant}}fromJSON(e){return this.normal.fromArray(e.normal),this.constant=e.constant,this}},Iv=0,Oi=class extends Ui{constructor(){super(),this.isMaterial=!0,Object.defineProperty(this,"id",{value:Iv++}),this.uuid=tr(),this.name="",this.type="Material",this.blending=xo,this.side=Qs,this.vertexColors=!1,this.opacity=1,this.transparent=!1,this.alphaHash=!1,this.blendSrc=md,this.blendDst=gd,this.blendEquation=mr,this.blendSrcAlpha=null,this.blendDstAlpha=null,this.blendEquationAlpha=null,this.blendColor=new tt(0,0,0),this.blendAlpha=0,this.depthFunc=no,this.depthTest=!0,this.depthWrite=!0,this.stencilWriteMask=255,this.stencilFunc=rg,this.stencilRef=0,this.stencilFuncMask=255,this.stencilFail=Jl,this.stencilZFail=Jl,this.stencilZPass=Jl,this.stencilWrite=!1,this.clippingPlanes=null,this.clipIntersection=!1,this.clipShadows=!1,this.shadowSide=null,this.colorWrite=!0,this.precision=null,this.polygonOffset=!1,this.polygonOffsetFactor=0,this.polygonOffsetUnits=0,this.dithering=!1,this.alphaToCoverage=!1,this.premultipliedAlpha=!1,this.forceSinglePass=!1,this.allowOverride=!0,this.visible=!0,this.toneMapped=!0,this.userData={},this.version=0,this._alphaTest=0}get alphaTest(){return this._alphaTest}set alphaTest(e){this._alphaTest>0!=e>0&&this.version++,this._alphaTest=e}onBeforeRender(){}onBeforeCompile(){}customProgramCacheKey(){return this.onBeforeCompile.toString()}setValues(e){if(e!==void 0)for(let t in e){let i=e[t];if(i===void 0){$e(`Material: parameter '${t}' has value of undefined.`);continue}let s=this[t];if(s===void 0){$e(`Material: '${t}' is not a property of THREE.${this.type}.`);continue}s&&s.isColor?s.set(i):s&&s.isVector2&&i&&i.isVector2||s&&s.isEuler&&i&&i.isEuler||s&&s.isVector3&&i&&i.isVector3?s.copy(i):this[t]=i}}toJSON(e){let t=e===void 0||typeof e=="string";t&&(e={textures:{},images:{}});let i={metadata:{version:4.7,type:"Material",generator:"Material.toJSON"}};i.uuid=this.uuid,i.type=this.type,i.blending=this.blending,i.side=this.side,i.shadowSide=this.shadowSide,i.vertexColors=this.vertexColors,i.opacity=this.opacity,i.transparent=this.transparent,i.blendSrc=this.blendSrc,i.blendDst=this.blendDst,i.blendEquation=this.blendEquation,i.blendSrcAlpha=this.blendSrcAlpha,i.blendDstAlpha=this.blendDstAlpha,i.blendEquationAlpha=this.blendEquationAlpha,i.blendColor=this.blendColor.getHex(),i.blendAlpha=this.blendAlpha,i.depthFunc=this.depthFunc,i.depthTest=this.depthTest,i.depthWrite=this.depthWrite,i.colorWrite=this.colorWrite,i.clipIntersection=this.clipIntersection,i.clipShadows=this.clipShadows,i.stencilWriteMask=this.stencilWriteMask,i.stencilFunc=this.stencilFunc,i.stencilRef=this.stencilRef,i.stencilFuncMask=this.stencilFuncMask,i.stencilFail=this.stencilFail,i.stencilZFail=this.stencilZFail,i.stencilZPass=this.stencilZPass,i.stencilWrite=this.stencilWrite,i.polygonOffset=this.polygonOffset,i.polygonOffsetFactor=this.polygonOffsetFactor,i.polygonOffsetUnits=this.polygonOffsetUnits,i.dithering=this.dithering,i.alphaTest=this.alphaTest,i.alphaHash=this.alphaHash,i.alphaToCoverage=this.alphaToCoverage,i.premultipliedAlpha=this.premultipliedAlpha,i.forceSinglePass=this.forceSinglePass,i.allowOverride=this.allowOverride,i.visible=this.visible,i.toneMapped=this.toneMapped,i.name=this.name,this.color&&this.color.isColor&&(i.color=this.color.getHex()),this.roughness!==void 0&&(i.roughness=this.roughness),this.metalness!==void 0&&(i.metalness=this.metalness),this.sheen!==void 0&&(i.sheen=this.sheen),this.sheenColor&&this.sheenColor.isColor&&(i.sheenColor=this.sheenColor.getHex()),this.sheenRoughness!==void 0&&(i.sheenRoughness=this.sheenRoughness),this.emissive&&this.emissive.isColor&&(i.emissive=this.emissive.getHex()),this.emissiveIntensity!==void 0&&(i.emissiveIntensity=this.emissiveIntensity),this.specular&&this.specular.isColor&&(i.specular=this.specular.getHex()),this.specularIntensity!==void 0&&(i.specularIntensity=this.specularIntensity),this.specularColor&&this.specularColor.isColor&&(i.specularColor=this.specularColor.getHex()),this.shininess!==void 0&&(i.shininess=this.shininess),this.clearcoat!==void 0&&(i.clearcoat=this.clearcoat),this.clearcoatRoughness!==void 0&&(i.clearcoatRoughness=this.clearcoatRoughness),this.diffuseRoughness!==void 0&&(i.diffuseRoughness=this.diffuseRoughness),this.diffuseRoughnessMap&&this.diffuseRoughnessMap.isTexture&&(i.diffuseRoughnessMap=this.diffuseRoughnessMap.toJSON(e).uuid),this.clearcoatMap&&this.clearcoatMap.isTexture&&(i.clearcoatMap=this.clearcoatMap.toJSON(e).uuid),this.clearcoatRoughnessMap&&this.clearcoatRoughnessMap.isTexture&&(i.clearcoatRoughnessMap=this.clearcoatRoughnessMap.toJSON(e).uuid),this.clearcoatNormalMap&&this.clearcoatNormalMap.isTexture&&(i.clearcoatNormalMap=this.clearcoatNormalMap.toJSON(e).uuid,i.clearcoatNormalScale=this.clearcoatNormalScale.toArray()),this.sheenColorMap&&this.sheenColorMap.isTexture&&(i.sheenColorMap=this.sheenColorMap.toJSON(e).uuid),this.sheenRoughnessMap&&this.sheenRoughnessMap.isTexture&&(i.sheenRoughnessMap=this.sheenRoughnessMap.toJSON(e).uuid),this.dispersion!==void 0&&(i.dispersion=this.dispersion),this.retroreflectivity!==void 0&&(i.retroreflectivity=this.retroreflectivity),this.iridescence!==void 0&&(i.iridescence=this.iridescence),this.iridescenceIOR!==void 0&&(i.iridescenceIOR=this.iridescenceIOR),this.iridescenceThicknessMinimum!==void 0&&(i.iridescenceThicknessMinimum=this.iridescenceThicknessMinimum),this.iridescenceThicknessMaximum!==void 0&&(i.iridescenceThicknessMaximum=this.iridescenceThicknessMaximum),this.iridescenceMap&&this.iridescenceMap.isTexture&&(i.iridescenceMap=this.iridescenceMap.toJSON(e).uuid),this.iridescenceThicknessMap&&this.iridescenceThicknessMap.isTexture&&(i.iridescenceThicknessMap=this.iridescenceThicknessMap.toJSON(e).uuid),this.anisotropy!==void 0&&(i.anisotropy=this.anisotropy),this.anisotropyRotation!==void 0&&(i.anisotropyRotation=this.anisotropyRotation),this.anisotropyMap&&this.anisotropyMap.isTexture&&(i.anisotropyMap=this.anisotropyMap.toJSON(e).uuid),this.map&&this.map.isTexture&&(i.map=this.map.toJSON(e).uuid),this.matcap&&this.matcap.isTexture&&(i.matcap=this.matcap.toJSON(e).uuid),this.alphaMap&&this.alphaMap.isTexture&&(i.alphaMap=this.alphaMap.toJSON(e).uuid),this.lightMap&&this.lightMap.isTexture&&(i.lightMap=this.lightMap.toJSON(e).uuid,i.lightMapIntensity=this.lightMapIntensity),this.aoMap&&this.aoMap.isTexture&&(i.aoMap=this.aoMap.toJSON(e).uuid,i.aoMapIntensity=this.aoMapIntensity),this.bumpMap&&this.bumpMap.isTexture&&(i.bumpMap=this.bumpMap.toJSON(e).uuid,i.bumpScale=this.bumpScale),this.normalMap&&this.normalMap.isTexture&&(i.normalMap=this.normalMap.toJSON(e).uuid,i.normalMapType=this.normalMapType,i.normalScale=this.normalScale.toArray()),this.displacementMap&&this.displacementMap.isTexture&&(i.displacementMap=this.displacementMap.toJSON(e).uuid,i.displacementScale=this.displacementScale,i.displacementBias=this.displacementBias),this.roughnessMap&&this.roughnessMap.isTexture&&(i.roughnessMap=this.roughnessMap.toJSON(e).uuid),this.metalnessMap&&this.metalnessMap.isTexture&&(i.metalnessMap=this.metalnessMap.toJSON(e).uuid),this.emissiveMap&&this.emissiveMap.isTexture&&(i.emissiveMap=this.emissiveMap.toJSON(e).uuid),this.specularMap&&this.specularMap.isTexture&&(i.specularMap=this.specularMap.toJSON(e).uuid),this.specularIntensityMap&&this.specularIntensityMap.isTexture&&(i.specularIntensityMap=this.specularIntensityMap.toJSON(e).uuid),this.specularColorMap&&this.specularColorMap.isTexture&&(i.specularColorMap=this.specularColorMap.toJSON(e).uuid),this.envMap&&this.envMap.isTexture&&(i.envMap=this.envMap.toJSON(e).uuid,this.combine!==void 0&&(i.combine=this.combine)),this.envMapRotation!==void 0&&(i.envMapRotation=this.envMapRotation.toArray()),this.envMapIntensity!==void 0&&(i.envMapIntensity=this.envMapIntensity),this.reflectivity!==void 0&&(i.reflectivity=this.reflectivity),this.refractionRatio!==void 0&&(i.refractionRatio=this.refractionRatio),this.gradientMap&&this.gradientMap.isTexture&&(i.gradientMap=this.gradientMap.toJSON(e).uuid),this.transmission!==void 0&&(i.transmission=this.transmission),this.transmissionMap&&this.transmissionMap.isTexture&&(i.transmissionMap=this.transmissionMap.toJSON(e).uuid),this.thickness!==void 0&&(i.thickness=this.thickness),this.thicknessMap&&this.thicknessMap.isTexture&&(i.thicknessMap=this.thicknessMap.toJSON(e).uuid),this.attenuationDistance!==void 0&&(i.attenuationDistance=this.attenuationDistance),this.attenuationColor!==void 0&&(i.attenuationColor=this.attenuationColor.getHex()),this.size!==void 0&&(i.size=this.size),this.sizeAttenuation!==void 0&&(i.sizeAttenuation=this.sizeAttenuation),Array.isArray(this.clippingPlanes)&&this.clippingPlanes.length>0&&(i.clippingPlanes=this.clippingPlanes.map(r=>r.toJSON())),this.rotation!==void 0&&(i.rotation=this.rotation),this.depthPacking!==void 0&&(i.depthPacking=this.depthPacking),this.linewidth!==void 0&&(i.linewidth=this.linewidth),this.linecap!==void 0&&(i.linecap=this.linecap),this.linejoin!==void 0&&(i.linejoin=this.linejoin),this.dashSize!==void 0&&(i.dashSize=this.dashSize),this.gapSize!==void 0&&(i.gapSize=this.gapSize),this.scale!==void 0&&(i.scale=this.scale),this.wireframe!==void 0&&(i.wireframe=this.wireframe),this.wireframeLinewidth!==void 0&&(i.wireframeLinewidth=this.wireframeLinewidth),this.wireframeLinecap!==void 0&&(i.wireframeLinecap=this.wireframeLinecap),this.wireframeLinejoin!==void 0&&(i.wireframeLinejoin=this.wireframeLinejoin),this.flatShading!==void 0&&(i.flatShading=this.flatShading),this.fog!==void 0&&(i.fog=this.fog),Object.keys(this.userData).length>0&&(i.userData=this.userData);function s(r){let o=[];for(let a in r){let l=r[a];delete l.metadata,o.push(l)}return o}if(t){let r=s(e.textures),o=s(e.images);r.length>0&&(i.textures=r),o.length>0&&(i.images=o)}return i}fromJSON(e,t){if(e.uuid!==void 0&&(this.uuid=e.uuid),e.name!==void 0&&(this.name=e.name),e.color!==void 0&&this.color!==void 0&&this.color.setHex(e.color),e.roughness!==void 0&&(this.roughness=e.roughness),e.metalness!==void 0&&(this.metalness=e.metalness),e.sheen!==void 0&&(this.sheen=e.sheen),e.sheenColor!==void 0&&(this.sheenColor=new tt().setHex(e.sheenColor)),e.sheenRoughness!==void 0&&(this.sheenRoughness=e.sheenRoughness),e.emissive!==void 0&&this.emissive!==void 0&&this.emissive.setHex(e.emissive),e.specular!==void 0&&this.specular!==void 0&&this.specular.setHex(e.specular),e.specularIntensity!==void 0&&(this.specularIntensity=e.specularIntensity),e.specularColor!==void 0&&this.specularColor!==void 0&&this.specularColor.setHex(e.specularColor),e.shininess!==void 0&&(this.shininess=e.shininess),e.clearcoat!==void 0&&(this.clearcoat=e.clearcoat),e.clearcoatRoughness!==void 0&&(this.clearcoatRoughness=e.clearcoatRoughness),e.diffuseRoughness!==void 0&&(this.diffuseRoughness=e.diffuseRoughness),e.dispersion!==void 0&&(this.dispersion=e.dispersion),e.retroreflectivity!==void 0&&(this.retroreflectivity=e.retroreflectivity),e.iridescence!==void 0&&(this.iridescence=e.iridescence),e.iridescenceIOR!==void 0&&(this.iridescenceIOR=e.iridescenceIOR),e.iridescenceThicknessMinimum!==void 0&&(this.iridescenceThicknessMinimum=e.iridescenceThicknessMinimum),e.iridescenceThicknessMaximum!==void 0&&(this.iridescenceThicknessMaximum=e.iridescenceThicknessMaximum),e.iridescenceThicknessRange!==void 0&&(this.iridescenceThicknessMinimum=e.iridescenceThicknessRange[0],this.iridescenceThicknessMaximum=e.iridescenceThicknessRange[1]),e.transmission!==void 0&&(this.transmission=e.transmission),e.thickness!==void 0&&(this.thickness=e.thickness),e.attenuationDistance!==void 0&&(this.attenuationDistance=e.attenuationDistance),e.attenuationColor!==void 0&&this.attenuationColor!==void 0&&this.attenuationColor.setHex(e.attenuationColor),e.anisotropy!==void 0&&(this.anisotropy=e.anisotropy),e.anisotropyRotation!==void 0&&(this.anisotropyRotation=e.anisotropyRotation),e.fog!==void 0&&(this.fog=e.fog),e.flatShading!==void 0&&(this.flatShading=e.flatShading),e.blending!==void 0&&(this.blending=e.blending),e.combine!==void 0&&(this.combine=e.combine),e.side!==void 0&&(this.side=e.side),e.shadowSide!==void 0&&(this.shadowSide=e.shadowSide),e.opacity!==void 0&&(this.opacity=e.opacity),e.transparent!==void 0&&(this.transparent=e.transparent),e.alphaTest!==void 0&&(this.alphaTest=e.alphaTest),e.alphaHash!==void 0&&(this.alphaHash=e.alphaHash),e.depthFunc!==void 0&&(this.depthFunc=e.depthFunc),e.depthTest!==void 0&&(this.depthTest=e.depthTest),e.depthWrite!==void 0&&(this.depthWrite=e.depthWrite),e.colorWrite!==void 0&&(this.colorWrite=e.colorWrite),e.clippingPlanes!==void 0&&(this.clippingPlanes=e.clippingPlanes.map(i=>new pi().fromJSON(i))),e.clipIntersection!==void 0&&(this.clipIntersection=e.clipIntersection),e.clipShadows!==void 0&&(this.clipShadows=e.clipShadows),e.depthPacking!==void 0&&(this.depthPacking=e.depthPacking),e.blendSrc!==void 0&&(this.blendSrc=e.blendSrc),e.blendDst!==void 0&&(this.blendDst=e.blendDst),e.blendEquation!==void 0&&(this.blendEquation=e.blendEquation),e.blendSrcAlpha!==void 0&&(this.blendSrcAlpha=e.blendSrcAlpha),e.blendDstAlpha!==void 0&&(this.blendDstAlpha=e.blendDstAlpha),e.blendEquationAlpha!==void 0&&(this.blendEquationAlpha=e.blendEquationAlpha),e.blendColor!==void 0&&this.blendColor!==void 0&&this.blendColor.setHex(e.blendColor),e.blendAlpha!==void 0&&(this.blendAlpha=e.blendAlpha),e.stencilWriteMask!==void 0&&(this.stencilWriteMask=e.stencilWriteMask),e.stencilFunc!==void 0&&(this.stencilFunc=e.stencilFunc),e.stencilRef!==void 0&&(this.stencilRef=e.stencilRef),e.stencilFuncMask!==void 0&&(this.stencilFuncMask=e.stencilFuncMask),e.stencilFail!==void 0&&(this.stencilFail=e.stencilFail),e.stencilZFail!==void 0&&(this.stencilZFail=e.stencilZFail),e.stencilZPass!==void 0&&(this.stencilZPass=e.stencilZPass),e.stencilWrite!==void 0&&(this.stencilWrite=e.stencilWrite),e.wireframe!==void 0&&(this.wireframe=e.wireframe),e.wireframeLinewidth!==void 0&&(this.wireframeLinewidth=e.wireframeLinewidth),e.wireframeLinecap!==void 0&&(this.wireframeLinecap=e.wireframeLinecap),e.wireframeLinejoin!==void 0&&(this.wireframeLinejoin=e.wireframeLinejoin),e.rotation!==void 0&&(this.rotation=e.rotation),e.linewidth!==void 0&&(this.linewidth=e.linewidth),e.linecap!==void 0&&(this.linecap=e.linecap),e.linejoin!==void 0&&(this.linejoin=e.linejoin),e.dashSize!==void 0&&(this.dashSize=e.dashSize),e.gapSize!==void 0&&(this.gapSize=e.gapSize),e.scale!==void 0&&(this.scale=e.scale),e.polygonOffset!==void 0&&(this.polygonOffset=e.polygonOffset),e.polygonOffsetFactor!==void 0&&(this.polygonOffsetFactor=e.polygonOffsetFactor),e.polygonOffsetUnits!==void 0&&(this.polygonOffsetUnits=e.polygonOffsetUnits),e.dithering!==void 0&&(this.dithering=e.dithering),e.alphaToCoverage!==void 0&&(this.alphaToCoverage=e.alphaToCoverage),e.premultipliedAlpha!==void 0&&(this.premultipliedAlpha=e.premultipliedAlpha),e.forceSinglePass!==void 0&&(this.forceSinglePass=e.forceSinglePass),e.allowOverride!==void 0&&(this.allowOverride=e.allowOverride),e.visible!==void 0&&(this.visible=e.visible),e.toneMapped!==void 0&&(this.toneMapped=e.toneMapped),e.userData!==void 0&&(this.userData=e.userData),e.vertexColors!==void 0&&(typeof e.vertexColors=="number"?this.vertexColors=e.vertexColors>0:this.vertexColors=e.vertexColors),e.size!==void 0&&(this.size=e.size),e.sizeAttenuation!==void 0&&(this.sizeAttenuation=e.sizeAttenuation),e.map!==void 0&&(this.map=t[e.map]||null),e.matcap!==void 0&&(this.matcap=t[e.matcap]||null),e.alphaMap!==void 0&&(this.alphaMap=t[e.alphaMap]||null),e.bumpMap!==void 0&&(this.bumpMap=t[e.bumpMap]||null),e.bumpScale!==void 0&&(this.bumpScale=e.bumpScale),e.normalMap!==void 0&&(this.normalMap=t[e.normalMap]||null),e.normalMapType!==void 0&&(this.normalMapType=e.normalMapType),e.normalScale!==void 0){let i=e.normalScale;Array.isArray(i)===!1&&(i=[i,i]),this.normalScale=new qe().fromArray(i)}return e.displacementMap!==void 0&&(this.displacementMap=t[e.displacementMap]||null),e.displacementScale!==void 0&&(this.displacementScale=e.displacementScale),e.displacementBias!==void 0&&(this.displacementBias=e.displacementBias),e.roughnessMap!==void 0&&(this.roughnessMap=t[e.roughnessMap]||null),e.metalnessMap!==void 0&&(this.metalnessMap=t[e.metalnessMap]||null),e.emissiveMap!==void 0&&(this.emissiveMap=t[e.emissiveMap]||null),e.emissiveIntensity!==void 0&&(this.emissiveIntensity=e.emissiveIntensity),e.specularMap!==void 0&&(this.specularMap=t[e.specularMap]||null),e.specularIntensityMap!==void 0&&(this.specularIntensityMap=t[e.specularIntensityMap]||null),e.specularColorMap!==void 0&&(this.specularColorMap=t[e.specularColorMap]||null),e.envMap!==void 0&&(this.envMap=t[e.envMap]||null),e.envMapRotation!==void 0&&this.envMapRotation.fromArray(e.envMapRotation),e.envMapIntensity!==void 0&&(this.envMapIntensity=e.envMapIntensity),e.reflectivity!==void 0&&(this.reflectivity=e.reflectivity),e.refractionRatio!==void 0&&(this.refractionRatio=e.refractionRatio),e.lightMap!==void 0&&(this.lightMap=t[e.lightMap]||null),e.lightMapIntensity!==void 0&&(this.lightMapIntensity=e.lightMapIntensity),e.aoMap!==void 0&&(this.aoMap=t[e.aoMap]||null),e.aoMapIntensity!==void 0&&(this.aoMapIntensity=e.aoMapIntensity),e.gradientMap!==void 0&&(this.gradientMap=t[e.gradientMap]||null),e.clearcoatMap!==void 0&&(this.clearcoatMap=t[e.clearcoatMap]||null),e.clearcoatRoughnessMap!==void 0&&(this.clearcoatRoughnessMap=t[e.clearcoatRoughnessMap]||null),e.clearcoatNormalMap!==void 0&&(this.clearcoatNormalMap=t[e.clearcoatNormalMap]||null),e.clearcoatNormalScale!==void 0&&(this.clearcoatNormalScale=new qe().fromArray(e.clearcoatNormalScale)),e.diffuseRoughnessMap!==void 0&&(this.diffuseRoughnessMap=t[e.diffuseRoughnessMap]||null),e.iridescenceMap!==void 0&&(this.iridescenceMap=t[e.iridescenceMap]||null),e.iridescenceThicknessMap!==void 0&&(this.iridescenceThicknessMap=t[e.iridescenceThicknessMap]||null),e.transmissionMap!==void 0&&(this.transmissionMap=t[e.transmissionMap]||null),e.thicknessMap!==void 0&&(this.thicknessMap=t[e.thicknessMap]||null),e.anisotropyMap!==void 0&&(this.anisotropyMap=t[e.anisotropyMap]||null),e.sheenColorMap!==void 0&&(this.sheenColorMap=t[e.sheenColorMap]||null),e.sheenRoughnessMap!==void 0&&(this.sheenRoughnessMap=t[e.sheenRoughnessMap]||null),this}clone(){return new this.constructor().copy(this)}copy(e){this.name=e.name,this.blending=e.blending,this.side=e.side,this.vertexColors=e.vertexColors,this.opacity=e.opacity,this.transparent=e.transparent,this.blendSrc=e.blendSrc,this.blendDst=e.blendDst,this.blendEquation=e.blendEquation,this.blendSrcAlpha=e.blendSrcAlpha,this.blendDstAlpha=e.blendDstAlpha,this.blendEquationAlpha=e.blendEquationAlpha,this.blendColor.copy(e.blendColor),this.blendAlpha=e.blendAlpha,this.depthFunc=e.depthFunc,this.depthTest=e.depthTest,this.depthWrite=e.depthWrite,this.stencilWriteMask=e.stencilWriteMask,this.stencilFunc=e.stencilFunc,this.stencilRef=e.stencilRef,this.stencilFuncMask=e.stencilFuncMask,this.stencilFail=e.stencilFail,this.stencilZFail=e.stencilZFail,this.stencilZPass=e.stencilZPass,this.stencilWrite=e.stencilWrite;let t=e.clippingPlanes,i=null;if(t!==null){let s=t.length;i=new Array(s);for(let r=0;r!==s;++r)i[r]=t[r].clone()}return this.clippingPlanes=i,this.clipIntersection=e.clipIntersection,this.clipShadows=e.clipShadows,this.shadowSide=e.shadowSide,this.colorWrite=e.colorWrite,this.precision=e.precision,this.polygonOffset=e.polygonOffset,this.polygonOffsetFactor=e.polygonOffsetFactor,this.polygonOffsetUnits=e.polygonOffsetUnits,this.dithering=e.dithering,this.alphaTest=e.alphaTest,this.alphaHash=e.alphaHash,this.alphaToCoverage=e.alphaToCoverage,this.premultipliedAlpha=e.premultipliedAlpha,this.forceSinglePass=e.forceSinglePass,this.allowOverride=e.allowOverride,this.visible=e.visible,this.toneMapped=e.toneMapped,this.userData=JSON.parse(JSON.stringify(e.userData)),this}dispose(){this.dispatchEvent({type:"dispose"})}set needsUpdate(e){e===!0&&this.version++}},lo=class extends Oi{constructor(e){super(),this.isSpriteMaterial=!0,this.type="SpriteMaterial",this.color=new tt(16777215),this.map=null,this.alphaMap=null,this.rotation=0,this.sizeAttenuation=!0,this.transparent=!0,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.alphaMap=e.alphaMap,this.rotation=e.rotation,this.sizeAttenuation=e.sizeAttenuation,this.fog=e.fog,this}},Yr,ta=new H,$r=new H,Zr=new H,Jr=new qe,na=new qe,gg=new Bt,El=new H,ia=new H,Al=new H,pm=new qe,Kh=new qe,mm=new qe,xa=class extends Sn{constructor(e=new lo){if(super(),this.isSprite=!0,this.type="Sprite",Yr===void 0){Yr=new Bn;let t=new Float32Array([-.5,-.5,0,0,0,.5,-.5,0,1,0,.5,.5,0,1,1,-.5,.5,0,0,1]),i=new uc(t,5);Yr.setIndex([0,1,2,0,2,3]),Yr.setAttribute("position",new _a(i,3,0,!1)),Yr.setAttribute("uv",new _a(i,2,3,!1))}this.geometry=Yr,this.material=e,this.center=new qe(.5,.5),this.count=1}intersectsFrustum(e){return e.intersectsSprite(this)}raycast(e,t){e.camera===null&&Qe('Sprite: "Raycaster.camera" needs to be set in order to raycast against sprites.'),$r.setFromMatrixScale(this.matrixWorld),gg.copy(e.camera.matrixWorld),this.modelViewMatrix.multiplyMatrices(e.camera.matrixWorldInverse,this.matrixWorld),Zr.setFromMatrixPosition(this.modelViewMatrix),e.camera.isPerspectiveCamera&&this.material.sizeAttenuation===!1&&$r.multiplyScalar(-Zr.z);let i=this.material.rotation,s,r;i!==0&&(r=Math.cos(i),s=Math.sin(i));let o=this.center;Cl(El.set(-.5,-.5,0),Zr,o,$r,s,r),Cl(ia.set(.5,-.5,0),Zr,o,$r,s,r),Cl(Al.set(.5,.5,0),Zr,o,$r,s,r),pm.set(0,0),Kh.set(1,0),mm.set(1,1);let a=e.ray.intersectTriangle(El,ia,Al,!1,ta);if(a===null&&(Cl(ia.set(-.5,.5,0),Zr,o,$r,s,r),Kh.set(0,1),a=e.ray.intersectTriangle(El,Al,ia,!1,ta),a===null))return;let l=e.ray.origin.distanceTo(ta);l<e.near||l>e.far||t.push({distance:l,point:ta.clone(),uv:ji.getInterpolation(ta,El,ia,Al,pm,Kh,mm,new qe),face:null,object:this})}copy(e,t){return super.copy(e,t),e.center!==void 0&&this.center.copy(e.center),this.material=e.material,this}toJSON(e){let t=super.toJSON(e);return t.object.center=this.center.toArray(),t}};function Cl(n,e,t,i,s,r){Jr.subVectors(n,t).addScalar(.5).multiply(i),s!==void 0?(na.x=r*Jr.x-s*Jr.y,na.y=s*Jr.x+r*Jr.y):na.copy(Jr),n.copy(e),n.x+=na.x,n.y+=na.y,n.applyMatrix4(gg)}var ys=new H,jh=new H,Rl=new H,Pl=new H,qs=class{constructor(e=new H,t=new H(0,0,-1)){this.origin=e,this.direction=t}set(e,t){return this.origin.copy(e),this.direction.copy(t),this}copy(e){return this.origin.copy(e.origin),this.direction.copy(e.direction),this}at(e,t){return t.copy(this.origin).addScaledVector(this.direction,e)}lookAt(e){return this.direction.copy(e).sub(this.origin).normalize(),this}recast(e){return this.origin.copy(this.at(e,ys)),this}closestPointToPoint(e,t){t.subVectors(e,this.origin);let i=t.dot(this.direction);return i<0?t.copy(this.origin):t.copy(this.origin).addScaledVector(this.direction,i)}distanceToPoint(e){return Math.sqrt(this.distanceSqToPoint(e))}distanceSqToPoint(e){let t=ys.subVectors(e,this.origin).dot(this.direction);return t<0?this.origin.distanceToSquared(e):(ys.copy(this.origin).addScaledVector(this.direction,t),ys.distanceToSquared(e))}distanceSqToSegment(e,t,i,s){jh.copy(e).add(t).multiplyScalar(.5),Rl.copy(t).sub(e).normalize(),Pl.copy(this.origin).sub(jh);let r=e.distanceTo(t)*.5,o=-this.direction.dot(Rl),a=Pl.dot(this.direction),l=-Pl.dot(Rl),c=Pl.lengthSq(),u=Math.abs(1-o*o),d,h,f,m;if(u>0)if(d=o*l-a,h=o*a-l,m=r*u,d>=0)if(h>=-m)if(h<=m){let y=1/u;d*=y,h*=y,f=d*(d+o*h+2*a)+h*(o*d+h+2*l)+c}else h=r,d=Math.max(0,-(o*h+a)),f=-d*d+h*(h+2*l)+c;else h=-r,d=Math.max(0,-(o*h+a)),f=-d*d+h*(h+2*l)+c;else h<=-m?(d=Math.max(0,-(-o*r+a)),h=d>0?-r:Math.min(Math.max(-r,-l),r),f=-d*d+h*(h+2*l)+c):h<=m?(d=0,h=Math.min(Math.max(-r,-l),r),f=h*(h+2*l)+c):(d=Math.max(0,-(o*r+a)),h=d>0?r:Math.min(Math.max(-r,-l),r),f=-d*d+h*(h+2*l)+c);else h=o>0?-r:r,d=Math.max(0,-(o*h+a)),f=-d*d+h*(h+2*l)+c;return i&&i.copy(this.origin).addScaledVector(this.direction,d),s&&s.copy(jh).addScaledVector(Rl,h),f}intersectSphere(e,t){if(e.radius<0)return null;ys.subVectors(e.center,this.origin);let i=ys.dot(this.direction),s=ys.dot(ys)-i*i,r=e.radius*e.radius;if(s>r)return null;let o=Math.sqrt(r-s),a=i-o,l=i+o;return l<0?null:a<0?this.at(l,t):this.at(a,t)}intersectsSphere(e){return e.radius<0?!1:this.distanceSqToPoint(e.center)<=e.radius*e.radius}distanceToPlane(e){let t=e.normal.dot(this.direction);if(t===0)return e.distanceToPoint(this.origin)===0?0:null;let i=-(this.origin.dot(e.normal)+e.constant)/t;return i>=0?i:null}intersectPlane(e,t){let i=this.distanceToPlane(e);return i===null?null:this.at(i,t)}intersectsPlane(e){let t=e.distanceToPoint(this.origin);return t===0||e.normal.dot(this.direction)*t<0}intersectBox(e,t){let i,s,r,o,a,l,c=1/this.direction.x,u=1/this.direction.y,d=1/this.direction.z,h=this.origin;return c>=0?(i=(e.min.x-h.x)*c,s=(e.max.x-h.x)*c):(i=(e.max.x-h.x)*c,s=(e.min.x-h.x)*c),u>=0?(r=(e.min.y-h.y)*u,o=(e.max.y-h.y)*u):(r=(e.max.y-h.y)*u,o=(e.min.y-h.y)*u),i>o||r>s||((r>i||isNaN(i))&&(i=r),(o<s||isNaN(s))&&(s=o),d>=0?(a=(e.min.z-h.z)*d,l=(e.max.z-h.z)*d):(a=(e.max.z-h.z)*d,l=(e.min.z-h.z)*d),i>l||a>s)||((a>i||i!==i)&&(i=a),(l<s||s!==s)&&(s=l),s<0)?null:this.at(i>=0?i:s,t)}intersectsBox(e){return this.intersectBox(e,ys)!==null}intersectTriangle(e,t,i,s,r){let o=this.origin,a=this.direction,l=a.x,c=a.y,u=a.z,d=e.x-o.x,h=e.y-o.y,f=e.z-o.z,m=t.x-o.x,y=t.y-o.y,g=t.z-o.z,_=i.x-o.x,b=i.y-o.y,C=i.z-o.z,S=Math.abs(l),P=Math.abs(c),A=Math.abs(u),x,w,F,D,L,B,V,U,X,$,W,ce;if(S>=P&&S>=A?(F=l,B=d,X=m,ce=_,l>=0?(x=c,w=u,D=h,L=f,V=y,U=g,$=b,W=C):(x=u,w=c,D=f,L=h,V=g,U=y,$=C,W=b)):P>=A?(F=c,B=h,X=y,ce=b,c>=0?(x=u,w=l,D=f,L=d,V=g,U=m,$=C,W=_):(x=l,w=u,D=d,L=f,V=m,U=g,$=_,W=C)):(F=u,B=f,X=g,ce=C,u>=0?(x=l,w=c,D=d,L=h,V=m,U=y,$=_,W=b):(x=c,w=l,D=h,L=d,V=y,U=m,$=b,W=_)),F===0)return null;let K=x/F,Q=w/F,se=1/F,de=D-K*B,he=L-Q*B,ee=V-K*X,me=U-Q*X,xe=$-K*ce,Ae=W-Q*ce,Se=xe*me-Ae*ee,We=de*Ae-he*xe,ot=ee*he-me*de;if(s){if(Se<0||We<0||ot<0)return null}else if((Se<0||We<0||ot<0)&&(Se>0||We>0||ot>0))return null;let Ge=Se+We+ot;if(Ge===0)return null;let dt=se*(Se*B+We*X+ot*ce);return(Ge>0?dt<0:dt>0)?null:this.at(dt/Ge,r)}applyMatrix4(e){return this.origin.applyMatrix4(e),this.direction.transformDirection(e),this}equals(e){return e.origin.equals(this.origin)&&e.direction.equals(this.direction)}clone(){return new this.constructor().copy(this)}},co=class extends Oi{constructor(e){super(),this.isMeshBasicMaterial=!0,this.type="MeshBasicMaterial",this.color=new tt(16777215),this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.specularMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new Ms,this.combine=_d,this.reflectivity=1,this.refractionRatio=.98,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.lightMap=e.lightMap,this.lightMapIntensity=e.lightMapIntensity,this.aoMap=e.aoMap,this.aoMapIntensity=e.aoMapIntensity,this.specularMap=e.specularMap,this.alphaMap=e.alphaMap,this.envMap=e.envMap,this.envMapRotation.copy(e.envMapRotation),this.combine=e.combine,this.reflectivity=e.reflectivity,this.refractionRatio=e.refractionRatio,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.wireframeLinecap=e.wireframeLinecap,this.wireframeLinejoin=e.wireframeLinejoin,this.fog=e.fog,this}},gm=new Bt,dr=new qs,Il=new Xs,_m=new H,Ll=new H,Dl=new H,Nl=new H,Qh=new H,Ul=new H,xm=new H,Ol=new H,ri=class extends Sn{constructor(e=new Bn,t=new co){super(),this.isMesh=!0,this.type="Mesh",this.geometry=e,this.material=t,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.count=1,this.updateMorphTargets()}copy(e,t){return super.copy(e,t),e.morphTargetInfluences!==void 0?this.morphTargetInfluences=e.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,e.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},e.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(e.material)?e.material.slice():e.material,this.geometry=e.geometry,this}updateMorphTargets(){let t=this.geometry.morphAttributes,i=Object.keys(t);if(i.length>0){let s=t[i[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){let a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}getVertexPosition(e,t){let i=this.geometry,s=i.attributes.position,r=i.morphAttributes.position,o=i.morphTargetsRelative;t.fromBufferAttribute(s,e);let a=this.morphTargetInfluences;if(r&&a){Ul.set(0,0,0);for(let l=0,c=r.length;l<c;l++){let u=a[l],d=r[l];u!==0&&(Qh.fromBufferAttribute(d,e),o?Ul.addScaledVector(Qh,u):Ul.addScaledVector(Qh.sub(t),u))}t.add(Ul)}return t}intersectsFrustum(e){return e.intersectsObject(this)}raycast(e,t){let i=this.geometry,s=this.material,r=this.matrixWorld;s!==void 0&&(i.boundingSphere===null&&i.computeBoundingSphere(),Il.copy(i.boundingSphere),Il.applyMatrix4(r),dr.copy(e.ray).recast(e.near),!(Il.containsPoint(dr.origin)===!1&&(dr.intersectSphere(Il,_m)===null||dr.origin.distanceToSquared(_m)>(e.far-e.near)**2))&&(gm.copy(r).invert(),dr.copy(e.ray).applyMatrix4(gm),!(i.boundingBox!==null&&dr.intersectsBox(i.boundingBox)===!1)&&this._computeIntersections(e,t,dr)))}_computeIntersections(e,t,i){let s,r=this.geometry,o=this.material,a=r.index,l=r.attributes.position,c=r.attributes.uv,u=r.attributes.uv1,d=r.attributes.normal,h=r.groups,f=r.drawRange;if(a!==null)if(Array.isArray(o))for(let m=0,y=h.length;m<y;m++){let g=h[m],_=o[g.materialIndex],b=Math.max(g.start,f.start),C=Math.min(a.count,Math.min(g.start+g.count,f.start+f.count));for(let S=b,P=C;S<P;S+=3){let A=a.getX(S),x=a.getX(S+1),w=a.getX(S+2);s=Fl(this,_,e,i,c,u,d,A,x,w),s&&(s.faceIndex=Math.floor(S/3),s.face.materialIndex=g.materialIndex,t.push(s))}}else{let m=Math.max(0,f.start),y=Math.min(a.count,f.start+f.count);for(let g=m,_=y;g<_;g+=3){let b=a.getX(g),C=a.getX(g+1),S=a.getX(g+2);s=Fl(this,o,e,i,c,u,d,b,C,S),s&&(s.faceIndex=Math.floor(g/3),t.push(s))}}else if(l!==void 0)if(Array.isArray(o))for(let m=0,y=h.length;m<y;m++){let g=h[m],_=o[g.materialIndex],b=Math.max(g.start,f.start),C=Math.min(l.count,Math.min(g.start+g.count,f.start+f.count));for(let S=b,P=C;S<P;S+=3){let A=S,x=S+1,w=S+2;s=Fl(this,_,e,i,c,u,d,A,x,w),s&&(s.faceIndex=Math.floor(S/3),s.face.materialIndex=g.materialIndex,t.push(s))}}else{let m=Math.max(0,f.start),y=Math.min(l.count,f.start+f.count);for(let g=m,_=y;g<_;g+=3){let b=g,C=g+1,S=g+2;s=Fl(this,o,e,i,c,u,d,b,C,S),s&&(s.faceIndex=Math.floor(g/3),t.push(s))}}}};function Lv(n,e,t,i,s,r,o,a){let l;if(e.side===ti?l=i.intersectTriangle(o,r,s,!0,a):l=i.intersectTriangle(s,r,o,e.side===Qs,a),l===null)return null;Ol.copy(a),Ol.applyMatrix4(n.matrixWorld);let c=t.ray.origin.distanceTo(Ol);return c<t.near||c>t.far?null:{distance:c,point:Ol.clone(),object:n}}function Fl(n,e,t,i,s,r,o,a,l,c){n.getVertexPosition(a,Ll),n.getVertexPosition(l,Dl),n.getVertexPosition(c,Nl);let u=Lv(n,e,t,i,Ll,Dl,Nl,xm);if(u){let d=new H;ji.getBarycoord(xm,Ll,Dl,Nl,d),s&&(u.uv=ji.getInterpolatedAttribute(s,a,l,c,d,new qe)),r&&(u.uv1=ji.getInterpolatedAttribute(r,a,l,c,d,new qe)),o&&(u.normal=ji.getInterpolatedAttribute(o,a,l,c,d,new H),u.normal.dot(i.direction)>0&&u.normal.multiplyScalar(-1));let h={a,b:l,c,normal:new H,materialIndex:0};ji.getNormal(Ll,Dl,Nl,h.normal),u.face=h,u.barycoord=d}return u}var hc=class extends ei{constructor(e=null,t=1,i=1,s,r,o,a,l,c=Nn,u=Nn,d,h){super(null,o,a,l,c,u,s,r,d,h),this.isDataTexture=!0,this.image={data:e,width:t,height:i},this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}};var fr=new Xs,Dv=new qe(.5,.5),kl=new H,Ys=class{constructor(e=new pi,t=new pi,i=new pi,s=new pi,r=new pi,o=new pi){this.planes=[e,t,i,s,r,o]}set(e,t,i,s,r,o){let a=this.planes;return a[0].copy(e),a[1].copy(t),a[2].copy(i),a[3].copy(s),a[4].copy(r),a[5].copy(o),this}copy(e){let t=this.planes;for(let i=0;i<6;i++)t[i].copy(e.planes[i]);return this}setFromProjectionMatrix(e,t=Mi,i=!1){let s=this.planes,r=e.elements,o=r[0],a=r[1],l=r[2],c=r[3],u=r[4],d=r[5],h=r[6],f=r[7],m=r[8],y=r[9],g=r[10],_=r[11],b=r[12],C=r[13],S=r[14],P=r[15];if(s[0].setComponents(c-o,f-u,_-m,P-b).normalize(),s[1].setComponents(c+o,f+u,_+m,P+b).normalize(),s[2].setComponents(c+a,f+d,_+y,P+C).normalize(),s[3].setComponents(c-a,f-d,_-y,P-C).normalize(),i)s[4].setComponents(l,h,g,S).normalize(),s[5].setComponents(c-l,f-h,_-g,P-S).normalize();else if(s[4].setComponents(c-l,f-h,_-g,P-S).normalize(),t===Mi)s[5].setComponents(c+l,f+h,_+g,P+S).normalize();else if(t===io)s[5].setComponents(l,h,g,S).normalize();else throw new Error("THREE.Frustum.setFromProjectionMatrix(): Invalid coordinate system: "+t);return this}intersectsObject(e){if(e.boundingSphere!==void 0)e.boundingSphere===null&&e.computeBoundingSphere(),fr.copy(e.boundingSphere).applyMatrix4(e.matrixWorld);else{let t=e.geometry;t.boundingSphere===null&&t.computeBoundingSphere(),fr.copy(t.boundingSphere).applyMatrix4(e.matrixWorld)}return this.intersectsSphere(fr)}intersectsSprite(e){fr.center.set(0,0,0);let t=Dv.distanceTo(e.center);return fr.radius=.7071067811865476+t,fr.applyMatrix4(e.matrixWorld),this.intersectsSphere(fr)}intersectsSphere(e){let t=this.planes,i=e.center,s=-e.radius;for(let r=0;r<6;r++)if(t[r].distanceToPoint(i)<s)return!1;return!0}intersectsBox(e){let t=this.planes;for(let i=0;i<6;i++){let s=t[i];if(kl.x=s.normal.x>0?e.max.x:e.min.x,kl.y=s.normal.y>0?e.max.y:e.min.y,kl.z=s.normal.z>0?e.max.z:e.min.z,s.distanceToPoint(kl)<0)return!1}return!0}containsPoint(e){let t=this.planes;for(let i=0;i<6;i++)if(t[i].distanceToPoint(e)<0)return!1;return!0}clone(){return new this.constructor().copy(this)}},vm=new Bt,dc=class n{constructor(){this.coordinateSystem=Mi,this._frustums=[],this._count=0}setFromArrayCamera(e){let t=e.cameras,i=this._frustums;for(let s=0;s<t.length;s++){let r=t[s];vm.multiplyMatrices(r.projectionMatrix,r.matrixWorldInverse),i[s]===void 0&&(i[s]=new Ys),i[s].setFromProjectionMatrix(vm,r.coordinateSystem,r.reversedDepth)}return this._count=t.length,this}getFrustum(e){return this._frustums[e]}intersectsObject(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsObject(e))return!0;return!1}intersectsSprite(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsSprite(e))return!0;return!1}intersectsSphere(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsSphere(e))return!0;return!1}intersectsBox(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsBox(e))return!0;return!1}containsPoint(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].containsPoint(e))return!0;return!1}copy(e){this.coordinateSystem=e.coordinateSystem;let t=this._frustums,i=e._frustums;for(let s=0;s<e._count;s++)t[s]===void 0&&(t[s]=new Ys),t[s].copy(i[s]);return this._count=e._count,this}clone(){return new n().copy(this)}};var es=class extends Oi{constructor(e){super(),this.isLineBasicMaterial=!0,this.type="LineBasicMaterial",this.color=new tt(16777215),this.map=null,this.linewidth=1,this.linecap="round",this.linejoin="round",this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.linewidth=e.linewidth,this.linecap=e.linecap,this.linejoin=e.linejoin,this.fog=e.fog,this}},fc=new H,pc=new H,ym=new Bt,sa=new qs,Bl=new Xs,ed=new H,bm=new H,mc=class extends Sn{constructor(e=new Bn,t=new es){super(),this.isLine=!0,this.type="Line",this.geometry=e,this.material=t,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.updateMorphTargets()}copy(e,t){return super.copy(e,t),e.morphTargetInfluences!==void 0?this.morphTargetInfluences=e.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,e.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},e.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(e.material)?e.material.slice():e.material,this.geometry=e.geometry,this}computeLineDistances(){let e=this.geometry;if(e.index===null){let t=e.attributes.position,i=[0];for(let s=1,r=t.count;s<r;s++)fc.fromBufferAttribute(t,s-1),pc.fromBufferAttribute(t,s),i[s]=i[s-1],i[s]+=fc.distanceTo(pc);e.setAttribute("lineDistance",new en(i,1))}else $e("Line.computeLineDistances(): Computation only possible with non-indexed BufferGeometry.");return this}intersectsFrustum(e){return e.intersectsObject(this)}raycast(e,t){let i=this.geometry,s=this.matrixWorld,r=e.params.Line.threshold,o=i.drawRange;if(i.boundingSphere===null&&i.computeBoundingSphere(),Bl.copy(i.boundingSphere),Bl.applyMatrix4(s),Bl.radius+=r,e.ray.intersectsSphere(Bl)===!1)return;ym.copy(s).invert(),sa.copy(e.ray).applyMatrix4(ym);let a=r/((this.scale.x+this.scale.y+this.scale.z)/3),l=a*a,c=this.isLineSegments?2:1,u=i.index,h=i.attributes.position;if(u!==null){let f=Math.max(0,o.start),m=Math.min(u.count,o.start+o.count);for(let y=f,g=m-1;y<g;y+=c){let _=u.getX(y),b=u.getX(y+1),C=zl(this,e,sa,l,_,b,y);C&&t.push(C)}if(this.isLineLoop){let y=u.getX(m-1),g=u.getX(f),_=zl(this,e,sa,l,y,g,m-1);_&&t.push(_)}}else{let f=Math.max(0,o.start),m=Math.min(h.count,o.start+o.count);for(let y=f,g=m-1;y<g;y+=c){let _=zl(this,e,sa,l,y,y+1,y);_&&t.push(_)}if(this.isLineLoop){let y=zl(this,e,sa,l,m-1,f,m-1);y&&t.push(y)}}}updateMorphTargets(){let t=this.geometry.morphAttributes,i=Object.keys(t);if(i.length>0){let s=t[i[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){let a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}};function zl(n,e,t,i,s,r,o){let a=n.geometry.attributes.position;if(fc.fromBufferAttribute(a,s),pc.fromBufferAttribute(a,r),t.distanceSqToSegment(fc,pc,ed,bm)>i)return;ed.applyMatrix4(n.matrixWorld);let c=e.ray.origin.distanceTo(ed);if(!(c<e.near||c>e.far))return{distance:c,point:bm.clone().applyMatrix4(n.matrixWorld),index:o,face:null,faceIndex:null,barycoord:null,object:n}}var Sm=new H,Mm=new H,uo=class extends mc{constructor(e,t){super(e,t),this.isLineSegments=!0,this.type="LineSegments"}computeLineDistances(){let e=this.geometry;if(e.index===null){let t=e.attributes.position,i=[];for(let s=0,r=t.count;s<r;s+=2)Sm.fromBufferAttribute(t,s),Mm.fromBufferAttribute(t,s+1),i[s]=s===0?0:i[s-1],i[s+1]=i[s]+Sm.distanceTo(Mm);e.setAttribute("lineDistance",new en(i,1))}else $e("LineSegments.computeLineDistances(): Computation only possible with non-indexed BufferGeometry.");return this}};var ho=class extends Oi{constructor(e){super(),this.isPointsMaterial=!0,this.type="PointsMaterial",this.color=new tt(16777215),this.map=null,this.alphaMap=null,this.size=1,this.sizeAttenuation=!0,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.alphaMap=e.alphaMap,this.size=e.size,this.sizeAttenuation=e.sizeAttenuation,this.fog=e.fog,this}},wm=new Bt,ad=new qs,Vl=new Xs,Gl=new H,va=class extends Sn{constructor(e=new Bn,t=new ho){super(),this.isPoints=!0,this.type="Points",this.geometry=e,this.material=t,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.updateMorphTargets()}copy(e,t){return super.copy(e,t),e.morphTargetInfluences!==void 0?this.morphTargetInfluences=e.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,e.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},e.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(e.material)?e.material.slice():e.material,this.geometry=e.geometry,this}intersectsFrustum(e){return e.intersectsObject(this)}raycast(e,t){let i=this.geometry,s=this.matrixWorld,r=e.params.Points.threshold,o=i.drawRange;if(i.boundingSphere===null&&i.computeBoundingSphere(),Vl.copy(i.boundingSphere),Vl.applyMatrix4(s),Vl.radius+=r,e.ray.intersectsSphere(Vl)===!1)return;wm.copy(s).invert(),ad.copy(e.ray).applyMatrix4(wm);let a=r/((this.scale.x+this.scale.y+this.scale.z)/3),l=a*a,c=i.index,d=i.attributes.position;if(c!==null){let h=Math.max(0,o.start),f=Math.min(c.count,o.start+o.count);for(let m=h,y=f;m<y;m++){let g=c.getX(m);Gl.fromBufferAttribute(d,g),Tm(Gl,g,l,s,e,t,this)}}else{let h=Math.max(0,o.start),f=Math.min(d.count,o.start+o.count);for(let m=h,y=f;m<y;m++)Gl.fromBufferAttribute(d,m),Tm(Gl,m,l,s,e,t,this)}}updateMorphTargets(){let t=this.geometry.morphAttributes,i=Object.keys(t);if(i.length>0){let s=t[i[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){let a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}};function Tm(n,e,t,i,s,r,o){let a=ad.distanceSqToPoint(n);if(a<t){let l=new H;ad.closestPointToPoint(n,l),l.applyMatrix4(i);let c=s.ray.origin.distanceTo(l);if(c<s.near||c>s.far)return;r.push({distance:c,distanceToRay:Math.sqrt(a),point:l,index:e,face:null,faceIndex:null,barycoord:null,object:o})}}var ya=class extends ei{constructor(e=[],t=gr,i,s,r,o,a,l,c,u){super(e,t,i,s,r,o,a,l,c,u),this.isCubeTexture=!0,this.flipY=!1}get images(){return this.image}set images(e){this.image=e}},ba=class extends ei{constructor(e,t,i,s,r,o,a,l,c){super(e,t,i,s,r,o,a,l,c),this.isCanvasTexture=!0,this.needsUpdate=!0}};var ws=class extends ei{constructor(e,t,i=Fi,s,r,o,a=Nn,l=Nn,c,u=Ss,d=1){if(u!==Ss&&u!==As)throw new Error("THREE.DepthTexture: format must be either THREE.DepthFormat or THREE.DepthStencilFormat");let h={width:e,height:t,depth:d};super(h,s,r,o,a,l,u,i,c),this.isDepthTexture=!0,this.flipY=!1,this.generateMipmaps=!1,this.compareFunction=null}copy(e){return super.copy(e),this.source=new oo(Object.assign({},e.image)),this.compareFunction=e.compareFunction,this}toJSON(e){let t=super.toJSON(e);return t.compareFunction=this.compareFunction,t}},Sa=class extends ws{constructor(e,t=Fi,i=gr,s,r,o=Nn,a=Nn,l,c=Ss){let u={width:e,height:e,depth:1},d=[u,u,u,u,u,u];super(e,e,t,i,s,r,o,a,l,c),this.image=d,this.isCubeDepthTexture=!0,this.isCubeTexture=!0}get images(){return this.image}set images(e){this.image=e}},Ma=class extends ei{constructor(e=null){super(),this.sourceTexture=e,this.isExternalTexture=!0}copy(e){return super.copy(e),this.sourceTexture=e.sourceTexture,this}},Ts=class n extends Bn{constructor(e=1,t=1,i=1,s=1,r=1,o=1){super(),this.type="BoxGeometry",this.parameters={width:e,height:t,depth:i,widthSegments:s,heightSegments:r,depthSegments:o};let a=this;s=Math.floor(s),r=Math.floor(r),o=Math.floor(o);let l=[],c=[],u=[],d=[],h=0,f=0;m("z","y","x",-1,-1,i,t,e,o,r,0),m("z","y","x",1,-1,i,t,-e,o,r,1),m("x","z","y",1,1,e,i,t,s,o,2),m("x","z","y",1,-1,e,i,-t,s,o,3),m("x","y","z",1,-1,e,t,i,s,r,4),m("x","y","z",-1,-1,e,t,-i,s,r,5),this.setIndex(l),this.setAttribute("position",new en(c,3)),this.setAttribute("normal",new en(u,3)),this.setAttribute("uv",new en(d,2));function m(y,g,_,b,C,S,P,A,x,w,F){let D=S/x,L=P/w,B=S/2,V=P/2,U=A/2,X=x+1,$=w+1,W=0,ce=0,K=new H;for(let Q=0;Q<$;Q++){let se=Q*L-V;for(let de=0;de<X;de++){let he=de*D-B;K[y]=he*b,K[g]=se*C,K[_]=U,c.push(K.x,K.y,K.z),K[y]=0,K[g]=0,K[_]=A>0?1:-1,u.push(K.x,K.y,K.z),d.push(de/x),d.push(1-Q/w),W+=1}}for(let Q=0;Q<w;Q++)for(let se=0;se<x;se++){let de=h+se+X*Q,he=h+se+X*(Q+1),ee=h+(se+1)+X*(Q+1),me=h+(se+1)+X*Q;l.push(de,he,me),l.push(he,ee,me),ce+=6}a.addGroup(f,ce,F),f+=ce,h+=W}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.width,e.height,e.depth,e.widthSegments,e.heightSegments,e.depthSegments)}};var wa=class n extends Bn{constructor(e=1,t=1,i=1,s=32,r=1,o=!1,a=0,l=Math.PI*2){super(),this.type="CylinderGeometry",this.parameters={radiusTop:e,radiusBottom:t,height:i,radialSegments:s,heightSegments:r,openEnded:o,thetaStart:a,thetaLength:l};let c=this;s=Math.floor(s),r=Math.floor(r);let u=[],d=[],h=[],f=[],m=0,y=[],g=i/2,_=0;b(),o===!1&&(e>0&&C(!0),t>0&&C(!1)),this.setIndex(u),this.setAttribute("position",new en(d,3)),this.setAttribute("normal",new en(h,3)),this.setAttribute("uv",new en(f,2));function b(){let S=new H,P=new H,A=0,x=(t-e)/i;for(let w=0;w<=r;w++){let F=[],D=w/r,L=D*(t-e)+e;for(let B=0;B<=s;B++){let V=B/s,U=V*l+a,X=Math.sin(U),$=Math.cos(U);P.x=L*X,P.y=-D*i+g,P.z=L*$,d.push(P.x,P.y,P.z),S.set(X,x,$).normalize(),h.push(S.x,S.y,S.z),f.push(V,1-D),F.push(m++)}y.push(F)}for(let w=0;w<s;w++)for(let F=0;F<r;F++){let D=y[F][w],L=y[F+1][w],B=y[F+1][w+1],V=y[F][w+1];(e>0||F!==0)&&(u.push(D,L,V),A+=3),(t>0||F!==r-1)&&(u.push(L,B,V),A+=3)}c.addGroup(_,A,0),_+=A}function C(S){let P=m,A=new qe,x=new H,w=0,F=S===!0?e:t,D=S===!0?1:-1;for(let B=1;B<=s;B++)d.push(0,g*D,0),h.push(0,D,0),f.push(.5,.5),m++;let L=m;for(let B=0;B<=s;B++){let U=B/s*l+a,X=Math.cos(U),$=Math.sin(U);x.x=F*$,x.y=g*D,x.z=F*X,d.push(x.x,x.y,x.z),h.push(0,D,0),A.x=X*.5+.5,A.y=$*.5*D+.5,f.push(A.x,A.y),m++}for(let B=0;B<s;B++){let V=P+B,U=L+B;S===!0?u.push(U,U+1,V):u.push(U+1,U,V),w+=3}c.addGroup(_,w,S===!0?1:2),_+=w}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.radiusTop,e.radiusBottom,e.height,e.radialSegments,e.heightSegments,e.openEnded,e.thetaStart,e.thetaLength)}};var Hl=new H,Wl=new H,td=new H,Xl=new ji,Ta=class extends Bn{constructor(e=null,t=1){if(super(),this.type="EdgesGeometry",this.parameters={geometry:e,thresholdAngle:t},e!==null){let s=Math.pow(10,4),r=Math.cos(eo*t),o=e.getIndex(),a=e.getAttribute("position"),l=o?o.count:a.count,c=[0,0,0],u=["a","b","c"],d=new Array(3),h=new Map,f=[];for(let m=0;m<l;m+=3){o?(c[0]=o.getX(m),c[1]=o.getX(m+1),c[2]=o.getX(m+2)):(c[0]=m,c[1]=m+1,c[2]=m+2);let{a:y,b:g,c:_}=Xl;if(y.fromBufferAttribute(a,c[0]),g.fromBufferAttribute(a,c[1]),_.fromBufferAttribute(a,c[2]),Xl.getNormal(td),d[0]=`${Math.round(y.x*s)},${Math.round(y.y*s)},${Math.round(y.z*s)}`,d[1]=`${Math.round(g.x*s)},${Math.round(g.y*s)},${Math.round(g.z*s)}`,d[2]=`${Math.round(_.x*s)},${Math.round(_.y*s)},${Math.round(_.z*s)}`,!(d[0]===d[1]||d[1]===d[2]||d[2]===d[0]))for(let b=0;b<3;b++){let C=(b+1)%3,S=d[b],P=d[C],A=Xl[u[b]],x=Xl[u[C]],w=`${S}_${P}`,F=`${P}_${S}`,D=h.get(F);D?(td.dot(D.normal)<=r&&(f.push(A.x,A.y,A.z),f.push(x.x,x.y,x.z)),h.set(F,null)):h.has(w)||h.set(w,{index0:c[b],index1:c[C],normal:td.clone()})}}for(let m of h.values())if(m){let{index0:y,index1:g}=m;Hl.fromBufferAttribute(a,y),Wl.fromBufferAttribute(a,g),f.push(Hl.x,Hl.y,Hl.z),f.push(Wl.x,Wl.y,Wl.z)}this.setAttribute("position",new en(f,3))}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}};var Ea=class n extends Bn{constructor(e=1,t=1,i=1,s=1){super(),this.type="PlaneGeometry",this.parameters={width:e,height:t,widthSegments:i,heightSegments:s};let r=e/2,o=t/2,a=Math.floor(i),l=Math.floor(s),c=a+1,u=l+1,d=e/a,h=t/l,f=[],m=[],y=[],g=[];for(let _=0;_<u;_++){let b=_*h-o;for(let C=0;C<c;C++){let S=C*d-r;m.push(S,-b,0),y.push(0,0,1),g.push(C/a),g.push(1-_/l)}}for(let _=0;_<l;_++)for(let b=0;b<a;b++){let C=b+c*_,S=b+c*(_+1),P=b+1+c*(_+1),A=b+1+c*_;f.push(C,S,A),f.push(S,P,A)}this.setIndex(f),this.setAttribute("position",new en(m,3)),this.setAttribute("normal",new en(y,3)),this.setAttribute("uv",new en(g,2))}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.width,e.height,e.widthSegments,e.heightSegments)}};var Aa=class n extends Bn{constructor(e=1,t=32,i=16,s=0,r=Math.PI*2,o=0,a=Math.PI){super(),this.type="SphereGeometry",this.parameters={radius:e,widthSegments:t,heightSegments:i,phiStart:s,phiLength:r,thetaStart:o,thetaLength:a},t=Math.max(3,Math.floor(t)),i=Math.max(2,Math.floor(i));let l=Math.min(o+a,Math.PI),c=0,u=[],d=new H,h=new H,f=[],m=[],y=[],g=[];for(let _=0;_<=i;_++){let b=[],C=_/i,S=o+C*a,P=e*Math.cos(S),A=Math.sqrt(e*e-P*P),x=0;_===0&&o===0?x=.5/t:_===i&&l===Math.PI&&(x=-.5/t);for(let w=0;w<=t;w++){let F=w/t,D=s+F*r;d.x=-A*Math.cos(D),d.y=P,d.z=A*Math.sin(D),m.push(d.x,d.y,d.z),h.copy(d).normalize(),y.push(h.x,h.y,h.z),g.push(F+x,1-C),b.push(c++)}u.push(b)}for(let _=0;_<i;_++)for(let b=0;b<t;b++){let C=u[_][b+1],S=u[_][b],P=u[_+1][b],A=u[_+1][b+1];(_!==0||o>0)&&f.push(C,S,A),(_!==i-1||l<Math.PI)&&f.push(S,P,A)}this.setIndex(f),this.setAttribute("position",new en(m,3)),this.setAttribute("normal",new en(y,3)),this.setAttribute("uv",new en(g,2))}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.radius,e.widthSegments,e.heightSegments,e.phiStart,e.phiLength,e.thetaStart,e.thetaLength)}};function xr(n){let e={};for(let t in n){e[t]={};for(let i in n[t]){let s=n[t][i];if(Em(s))s.isRenderTargetTexture?($e("UniformsUtils: Textures of render targets cannot be cloned via cloneUniforms() or mergeUniforms()."),e[t][i]=null):e[t][i]=s.clone();else if(Array.isArray(s))if(Em(s[0])){let r=[];for(let o=0,a=s.length;o<a;o++)r[o]=s[o].clone();e[t][i]=r}else e[t][i]=s.slice();else e[t][i]=s}}return e}function Wn(n){let e={};for(let t=0;t<n.length;t++){let i=xr(n[t]);for(let s in i)e[s]=i[s]}return e}function Em(n){return n&&(n.isColor||n.isMatrix3||n.isMatrix4||n.isVector2||n.isVector3||n.isVector4||n.isTexture||n.isQuaternion)}function Nv(n){let e=[];for(let t=0;t<n.length;t++)e.push(n[t].clone());return e}function Hd(n){let e=n.getRenderTarget();return e===null?n.outputColorSpace:e.isXRRenderTarget===!0?e.texture.colorSpace:yt.workingColorSpace}var _g={clone:xr,merge:Wn},Uv=`void main() {
	gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
}`,Ov=`void main() {
	gl_FragColor = vec4( 1.0, 0.0, 0.0, 1.0 );
}`,ts=class extends Oi{constructor(e){super(),this.isShaderMaterial=!0,this.type="ShaderMaterial",this.defines={},this.uniforms={},this.uniformsGroups=[],this.vertexShader=Uv,this.fragmentShader=Ov,this.linewidth=1,this.wireframe=!1,this.wireframeLinewidth=1,this.fog=!1,this.lights=!1,this.clipping=!1,this.forceSinglePass=!0,this.extensions={clipCullDistance:!1,multiDraw:!1},this.defaultAttributeValues={color:[1,1,1],uv:[0,0],uv1:[0,0]},this.index0AttributeName=void 0,this.uniformsNeedUpdate=!1,this.glslVersion=null,e!==void 0&&this.setValues(e)}copy(e){return super.copy(e),this.fragmentShader=e.fragmentShader,this.vertexShader=e.vertexShader,this.uniforms=xr(e.uniforms),this.uniformsGroups=Nv(e.uniformsGroups),this.defines=Object.assign({},e.defines),this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.fog=e.fog,this.lights=e.lights,this.clipping=e.clipping,this.extensions=Object.assign({},e.extensions),this.glslVersion=e.glslVersion,this.defaultAttributeValues=Object.assign({},e.defaultAttributeValues),this.index0AttributeName=e.index0AttributeName,this.uniformsNeedUpdate=e.uniformsNeedUpdate,this}toJSON(e){let t=super.toJSON(e);t.glslVersion=this.glslVersion,t.uniforms={};for(let s in this.uniforms){let o=this.uniforms[s].value;o&&o.isTexture?t.uniforms[s]={type:"t",value:o.toJSON(e).uuid}:o&&o.isColor?t.uniforms[s]={type:"c",value:o.getHex()}:o&&o.isVector2?t.uniforms[s]={type:"v2",value:o.toArray()}:o&&o.isVector3?t.uniforms[s]={type:"v3",value:o.toArray()}:o&&o.isVector4?t.uniforms[s]={type:"v4",value:o.toArray()}:o&&o.isMatrix3?t.uniforms[s]={type:"m3",value:o.toArray()}:o&&o.isMatrix4?t.uniforms[s]={type:"m4",value:o.toArray()}:t.uniforms[s]={value:o}}Object.keys(this.defines).length>0&&(t.defines=this.defines),t.vertexShader=this.vertexShader,t.fragmentShader=this.fragmentShader,t.lights=this.lights,t.clipping=this.clipping;let i={};for(let s in this.extensions)this.extensions[s]===!0&&(i[s]=!0);return Object.keys(i).length>0&&(t.extensions=i),t}fromJSON(e,t){if(super.fromJSON(e,t),e.uniforms!==void 0)for(let i in e.uniforms){let s=e.uniforms[i];switch(this.uniforms[i]={},s.type){case"t":this.uniforms[i].value=t[s.value]||null;break;case"c":this.uniforms[i].value=new tt().setHex(s.value);break;case"v2":this.uniforms[i].value=new qe().fromArray(s.value);break;case"v3":this.uniforms[i].value=new H().fromArray(s.value);break;case"v4":this.uniforms[i].value=new jt().fromArray(s.value);break;case"m3":this.uniforms[i].value=new nt().fromArray(s.value);break;case"m4":this.uniforms[i].value=new Bt().fromArray(s.value);break;default:this.uniforms[i].value=s.value}}if(e.defines!==void 0&&(this.defines=e.defines),e.vertexShader!==void 0&&(this.vertexShader=e.vertexShader),e.fragmentShader!==void 0&&(this.fragmentShader=e.fragmentShader),e.glslVersion!==void 0&&(this.glslVersion=e.glslVersion),e.extensions!==void 0)for(let i in e.extensions)this.extensions[i]=e.extensions[i];return e.lights!==void 0&&(this.lights=e.lights),e.clipping!==void 0&&(this.clipping=e.clipping),this}},gc=class extends ts{constructor(e){super(e),this.isRawShaderMaterial=!0,this.type="RawShaderMaterial"}},fo=class extends Oi{constructor(e){super(),this.isMeshStandardMaterial=!0,this.type="MeshStandardMaterial",this.defines={STANDARD:""},this.color=new tt(16777215),this.roughness=1,this.metalness=0,this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.emissive=new tt(0),this.emissiveIntensity=1,this.emissiveMap=null,this.bumpMap=null,this.bumpScale=1,this.normalMap=null,this.normalMapType=gu,this.normalScale=new qe(1,1),this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.roughnessMap=null,this.metalnessMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new Ms,this.envMapIntensity=1,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.flatShading=!1,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.defines={STANDARD:""},this.color.copy(e.color),this.roughness=e.roughness,this.metalness=e.metalness,this.map=e.map,this.lightMap=e.lightMap,this.lightMapIntensity=e.lightMapIntensity,this.aoMap=e.aoMap,this.aoMapIntensity=e.aoMapIntensity,this.emissive.copy(e.emissive),this.emissiveMap=e.emissiveMap,this.emissiveIntensity=e.emissiveIntensity,this.bumpMap=e.bumpMap,this.bumpScale=e.bumpScale,this.normalMap=e.normalMap,this.normalMapType=e.normalMapType,this.normalScale.copy(e.normalScale),this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this.roughnessMap=e.roughnessMap,this.metalnessMap=e.metalnessMap,this.alphaMap=e.alphaMap,this.envMap=e.envMap,this.envMapRotation.copy(e.envMapRotation),this.envMapIntensity=e.envMapIntensity,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.wireframeLinecap=e.wireframeLinecap,this.wireframeLinejoin=e.wireframeLinejoin,this.flatShading=e.flatShading,this.fog=e.fog,this}};var _c=class extends Oi{constructor(e){super(),this.isMeshDepthMaterial=!0,this.type="MeshDepthMaterial",this.depthPacking=ig,this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.wireframe=!1,this.wireframeLinewidth=1,this.setValues(e)}copy(e){return super.copy(e),this.depthPacking=e.depthPacking,this.map=e.map,this.alphaMap=e.alphaMap,this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this}},xc=class extends Oi{constructor(e){super(),this.isMeshDistanceMaterial=!0,this.type="MeshDistanceMaterial",this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.setValues(e)}copy(e){return super.copy(e),this.map=e.map,this.alphaMap=e.alphaMap,this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this}};var Ca=class extends es{constructor(e){super(),this.isLineDashedMaterial=!0,this.type="LineDashedMaterial",this.scale=1,this.dashSize=3,this.gapSize=1,this.setValues(e)}copy(e){return super.copy(e),this.scale=e.scale,this.dashSize=e.dashSize,this.gapSize=e.gapSize,this}};function Kr(n,e){return!n||n.constructor===e?n:typeof e.BYTES_PER_ELEMENT=="number"?new e(n):Array.prototype.slice.call(n)}function ql(n){return n!==void 0&&n.inTangents!==void 0&&n.outTangents!==void 0}var $s=class{constructor(e,t,i,s){this.parameterPositions=e,this._cachedIndex=0,this.resultBuffer=s!==void 0?s:new t.constructor(i),this.sampleValues=t,this.valueSize=i,this.settings=null,this.DefaultSettings_={}}evaluate(e){let t=this.parameterPositions,i=this._cachedIndex,s=t[i],r=t[i-1];e:{t:{let o;n:{i:if(!(e<s)){for(let a=i+2;;){if(s===void 0){if(e<r)break i;return i=t.length,this._cachedIndex=i,this.copySampleValue_(i-1)}if(i===a)break;if(r=s,s=t[++i],e<s)break t}o=t.length;break n}if(!(e>=r)){let a=t[1];e<a&&(i=2,r=a);for(let l=i-2;;){if(r===void 0)return this._cachedIndex=0,this.copySampleValue_(0);if(i===l)break;if(s=r,r=t[--i-1],e>=r)break t}o=i,i=0;break n}break e}for(;i<o;){let a=i+o>>>1;e<t[a]?o=a:i=a+1}if(s=t[i],r=t[i-1],r===void 0)return this._cachedIndex=0,this.copySampleValue_(0);if(s===void 0)return i=t.length,this._cachedIndex=i,this.copySampleValue_(i-1)}this._cachedIndex=i,this.intervalChanged_(i,r,s)}return this.interpolate_(i,r,e,s)}getSettings_(){return this.settings||this.DefaultSettings_}copySampleValue_(e){let t=this.resultBuffer,i=this.sampleValues,s=this.valueSize,r=e*s;for(let o=0;o!==s;++o)t[o]=i[r+o];return t}interpolate_(){throw new Error("THREE.Interpolant: Call to abstract method.")}intervalChanged_(){}},vc=class extends $s{constructor(e,t,i,s){super(e,t,i,s),this._weightPrev=-0,this._offsetPrev=-0,this._weightNext=-0,this._offsetNext=-0,this.DefaultSettings_={endingStart:sd,endingEnd:sd}}intervalChanged_(e,t,i){let s=this.parameterPositions,r=e-2,o=e+1,a=s[r],l=s[o];if(a===void 0)switch(this.getSettings_().endingStart){case rd:r=e,a=2*t-i;break;case od:r=s.length-2,a=t+s[r]-s[r+1];break;default:r=e,a=i}if(l===void 0)switch(this.getSettings_().endingEnd){case rd:o=e,l=2*i-t;break;case od:o=1,l=i+s[1]-s[0];break;default:o=e-1,l=t}let c=(i-t)*.5,u=this.valueSize;this._weightPrev=c/(t-a),this._weightNext=c/(l-i),this._offsetPrev=r*u,this._offsetNext=o*u}interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=e*a,c=l-a,u=this._offsetPrev,d=this._offsetNext,h=this._weightPrev,f=this._weightNext,m=(i-t)/(s-t),y=m*m,g=y*m,_=-h*g+2*h*y-h*m,b=(1+h)*g+(-1.5-2*h)*y+(-.5+h)*m+1,C=(-1-f)*g+(1.5+f)*y+.5*m,S=f*g-f*y;for(let P=0;P!==a;++P)r[P]=_*o[u+P]+b*o[c+P]+C*o[l+P]+S*o[d+P];return r}},yc=class extends $s{constructor(e,t,i,s){super(e,t,i,s)}interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=e*a,c=l-a,u=(i-t)/(s-t),d=1-u;for(let h=0;h!==a;++h)r[h]=o[c+h]*d+o[l+h]*u;return r}},bc=class extends $s{constructor(e,t,i,s){super(e,t,i,s)}interpolate_(e){return this.copySampleValue_(e-1)}},Sc=class extends $s{interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=e*a,c=l-a,u=this.inTangents,d=this.outTangents;if(!u||!d){let m=(i-t)/(s-t),y=1-m;for(let g=0;g!==a;++g)r[g]=o[c+g]*y+o[l+g]*m;return r}let h=a*2,f=e-1;for(let m=0;m!==a;++m){let y=o[c+m],g=o[l+m],_=f*h+m*2,b=d[_],C=d[_+1],S=e*h+m*2,P=u[S],A=u[S+1],x=kv(i,t,b,P,s);r[m]=xg(x,y,C,A,g)}return r}};function xg(n,e,t,i,s){let r=1-n;return r*r*r*e+3*r*r*n*t+3*r*n*n*i+n*n*n*s}function Fv(n,e,t,i,s){let r=1-n;return 3*r*r*(t-e)+6*r*n*(i-t)+3*n*n*(s-i)}function kv(n,e,t,i,s){let r=(n-e)/(s-e);for(let o=0;o<8;o++){let a=xg(r,e,t,i,s)-n;if(Math.abs(a)<1e-10)break;let l=Fv(r,e,t,i,s);if(Math.abs(l)<1e-10)break;r=Math.max(0,Math.min(1,r-a/l))}return r}var gi=class{constructor(e,t,i,s){if(e===void 0)throw new Error("THREE.KeyframeTrack: track name is undefined");if(t===void 0||t.length===0)throw new Error("THREE.KeyframeTrack: no keyframes in track named "+e);this.name=e,this.times=Kr(t,this.TimeBufferType),this.values=Kr(i,this.ValueBufferType),this.setInterpolation(s||this.DefaultInterpolation)}static toJSON(e){let t=e.constructor,i;if(t.toJSON!==this.toJSON)i=t.toJSON(e);else{i={name:e.name,times:Kr(e.times,Array),values:Kr(e.values,Array)};let s=e.getInterpolation();s!==e.DefaultInterpolation&&(i.interpolation=s),ql(e.settings)&&(i.settings={inTangents:Kr(e.settings.inTangents,Array),outTangents:Kr(e.settings.outTangents,Array)})}return i.type=e.ValueTypeName,i}InterpolantFactoryMethodDiscrete(e){return new bc(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodLinear(e){return new yc(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodSmooth(e){return new vc(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodBezier(e){let t=new Sc(this.times,this.values,this.getValueSize(),e);return this.settings&&(t.inTangents=this.settings.inTangents,t.outTangents=this.settings.outTangents),t}setInterpolation(e){let t;switch(e){case aa:t=this.InterpolantFactoryMethodDiscrete;break;case oc:t=this.InterpolantFactoryMethodLinear;break;case Zl:t=this.InterpolantFactoryMethodSmooth;break;case id:t=this.InterpolantFactoryMethodBezier;break}if(t===void 0){let i="unsupported interpolation for "+this.ValueTypeName+" keyframe track named "+this.name;if(this.createInterpolant===void 0)if(e!==this.DefaultInterpolation)this.setInterpolation(this.DefaultInterpolation);else throw new Error(i);return $e("KeyframeTrack:",i),this}return this.createInterpolant=t,this}getInterpolation(){switch(this.createInterpolant){case this.InterpolantFactoryMethodDiscrete:return aa;case this.InterpolantFactoryMethodLinear:return oc;case this.InterpolantFactoryMethodSmooth:return Zl;case this.InterpolantFactoryMethodBezier:return id}}getValueSize(){return this.values.length/this.times.length}shift(e){if(e!==0){let t=this.times;for(let i=0,s=t.length;i!==s;++i)t[i]+=e;ql(this.settings)&&(Am(this.settings.inTangents,e),Am(this.settings.outTangents,e))}return this}scale(e){if(e!==1){let t=this.times;for(let i=0,s=t.length;i!==s;++i)t[i]*=e;ql(this.settings)&&(Cm(this.settings.inTangents,e),Cm(this.settings.outTangents,e))}return this}trim(e,t){let i=this.times,s=i.length,r=0,o=s-1;for(;r!==s&&i[r]<e;)++r;for(;o!==-1&&i[o]>t;)--o;if(++o,r!==0||o!==s){r>=o&&(o=Math.max(o,1),r=o-1);let a=this.getValueSize();this.times=i.slice(r,o),this.values=this.values.slice(r*a,o*a)}return this}validate(){let e=!0,t=this.getValueSize();t-Math.floor(t)!==0&&(Qe("KeyframeTrack: Invalid value size in track.",this),e=!1);let i=this.times,s=this.values,r=i.length;r===0&&(Qe("KeyframeTrack: Track is empty.",this),e=!1);let o=null;for(let a=0;a!==r;a++){let l=i[a];if(typeof l=="number"&&isNaN(l)){Qe("KeyframeTrack: Time is not a valid number.",this,a,l),e=!1;break}if(o!==null&&o>l){Qe("KeyframeTrack: Out of order keys.",this,a,l,o),e=!1;break}o=l}if(s!==void 0&&ev(s))for(let a=0,l=s.length;a!==l;++a){let c=s[a];if(isNaN(c)){Qe("KeyframeTrack: Value is not a valid number.",this,a,c),e=!1;break}}return e}optimize(){let e=this.times.slice(),t=this.values.slice(),i=this.getValueSize(),s=this.getInterpolation()===Zl,r=e.length-1,o=1;for(let a=1;a<r;++a){let l=!1,c=e[a],u=e[a+1];if(c!==u&&(a!==1||c!==e[0]))if(s)l=!0;else{let d=a*i,h=d-i,f=d+i;for(let m=0;m!==i;++m){let y=t[d+m];if(y!==t[h+m]||y!==t[f+m]){l=!0;break}}}if(l){if(a!==o){e[o]=e[a];let d=a*i,h=o*i;for(let f=0;f!==i;++f)t[h+f]=t[d+f]}++o}}if(r>0){e[o]=e[r];for(let a=r*i,l=o*i,c=0;c!==i;++c)t[l+c]=t[a+c];++o}return o!==e.length?(this.times=e.slice(0,o),this.values=t.slice(0,o*i)):(this.times=e,this.values=t),this}clone(){let e=this.times.slice(),t=this.values.slice(),i=this.constructor,s=new i(this.name,e,t);return s.createInterpolant=this.createInterpolant,ql(this.settings)&&(s.settings={inTangents:this.settings.inTangents.slice(),outTangents:this.settings.outTangents.slice()}),s}};function Am(n,e){for(let t=0,i=n.length;t!==i;t+=2)n[t]+=e}function Cm(n,e){for(let t=0,i=n.length;t!==i;t+=2)n[t]*=e}gi.prototype.ValueTypeName="";gi.prototype.TimeBufferType=Float32Array;gi.prototype.ValueBufferType=Float32Array;gi.prototype.DefaultInterpolation=oc;var Zs=class extends gi{constructor(e,t,i){super(e,t,i)}};Zs.prototype.ValueTypeName="bool";Zs.prototype.ValueBufferType=Array;Zs.prototype.DefaultInterpolation=aa;Zs.prototype.InterpolantFactoryMethodLinear=void 0;Zs.prototype.InterpolantFactoryMethodSmooth=void 0;var Mc=class extends gi{constructor(e,t,i,s){super(e,t,i,s)}};Mc.prototype.ValueTypeName="color";var wc=class extends gi{constructor(e,t,i,s){super(e,t,i,s)}};wc.prototype.ValueTypeName="number";var Tc=class extends $s{constructor(e,t,i,s){super(e,t,i,s)}interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=(i-t)/(s-t),c=e*a;for(let u=c+a;c!==u;c+=4)Un.slerpFlat(r,0,o,c-a,o,c,l);return r}},Ra=class extends gi{constructor(e,t,i,s){super(e,t,i,s)}InterpolantFactoryMethodLinear(e){return new Tc(this.times,this.values,this.getValueSize(),e)}};Ra.prototype.ValueTypeName="quaternion";Ra.prototype.InterpolantFactoryMethodSmooth=void 0;var Js=class extends gi{constructor(e,t,i){super(e,t,i)}};Js.prototype.ValueTypeName="string";Js.prototype.ValueBufferType=Array;Js.prototype.DefaultInterpolation=aa;Js.prototype.InterpolantFactoryMethodLinear=void 0;Js.prototype.InterpolantFactoryMethodSmooth=void 0;var Ec=class extends gi{constructor(e,t,i,s){super(e,t,i,s)}};Ec.prototype.ValueTypeName="vector";var Ac=class{constructor(e,t,i){let s=this,r=!1,o=0,a=0,l,c=[];this.onStart=void 0,this.onLoad=e,this.onProgress=t,this.onError=i,this._abortController=null,this.itemStart=function(u){a++,r===!1&&s.onStart!==void 0&&s.onStart(u,o,a),r=!0},this.itemEnd=function(u){o++,s.onProgress!==void 0&&s.onProgress(u,o,a),o===a&&(r=!1,s.onLoad!==void 0&&s.onLoad())},this.itemError=function(u){s.onError!==void 0&&s.onError(u)},this.resolveURL=function(u){return u=u.normalize("NFC"),l?l(u):u},this.setURLModifier=function(u){return l=u,this},this.addHandler=function(u,d){return c.push(u,d),this},this.removeHandler=function(u){let d=c.indexOf(u);return d!==-1&&c.splice(d,2),this},this.getHandler=function(u){for(let d=0,h=c.length;d<h;d+=2){let f=c[d],m=c[d+1];if(f.global&&(f.lastIndex=0),f.test(u))return m}return null},this.abort=function(){return this.abortController.abort(),this._abortController=null,this}}get abortController(){return this._abortController||(this._abortController=new AbortController),this._abortController}},vg=new Ac,Cc=class{constructor(e){this.manager=e!==void 0?e:vg,this.crossOrigin="anonymous",this.withCredentials=!1,this.path="",this.resourcePath="",this.requestHeader={},this.priority="auto",this.cache="default",typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}load(){}loadAsync(e,t){let i=this;return new Promise(function(s,r){i.load(e,s,t,r)})}parse(){}setCrossOrigin(e){return this.crossOrigin=e,this}setWithCredentials(e){return this.withCredentials=e,this}setPath(e){return this.path=e,this}setResourcePath(e){return this.resourcePath=e,this}setRequestHeader(e){return this.requestHeader=e,this}setPriority(e){return this.priority=e,this}setCache(e){return this.cache=e,this}abort(){return this}};Cc.DEFAULT_MATERIAL_NAME="__DEFAULT";var Pa=class extends Sn{static registerNode(e){this.prototype._lightNode=e}constructor(e,t=1){super(),this.isLight=!0,this.type="Light",this.color=new tt(e),this.intensity=t}copy(e,t){return super.copy(e,t),this.color.copy(e.color),this.intensity=e.intensity,this}toJSON(e){let t=super.toJSON(e);return t.object.color=this.color.getHex(),t.object.intensity=this.intensity,t}},Ia=class extends Pa{constructor(e,t,i){super(e,i),this.isHemisphereLight=!0,this.type="HemisphereLight",this.position.copy(Sn.DEFAULT_UP),this.updateMatrix(),this.groundColor=new tt(t)}copy(e,t){return super.copy(e,t),this.groundColor.copy(e.groundColor),this}toJSON(e){let t=super.toJSON(e);return t.object.groundColor=this.groundColor.getHex(),t}},nd=new Bt,Rm=new H,Pm=new H,Rc=class{constructor(e){this.camera=e,this.intensity=1,this.bias=0,this.biasNode=null,this.normalBias=0,this.radius=1,this.blurSamples=8,this.mapSize=new qe(512,512),this.mapType=oi,this.map=null,this.mapPass=null,this.matrix=new Bt,this.autoUpdate=!0,this.needsUpdate=!1,this._frustum=new Ys,this._frameExtents=new qe(1,1),this._viewportCount=1,this._viewports=[new jt(0,0,1,1)]}getViewportCount(){return this._viewportCount}getCamera(){return this.camera}getFrustum(){return this._frustum}updateMatrices(e){let t=this.camera;Rm.setFromMatrixPosition(e.matrixWorld),t.position.copy(Rm),Pm.setFromMatrixPosition(e.target.matrixWorld),t.lookAt(Pm),t.updateMatrixWorld(),this._updateMatrix(t,this.matrix,this._frustum)}_updateMatrix(e,t,i,s){nd.multiplyMatrices(e.projectionMatrix,e.matrixWorldInverse),i.setFromProjectionMatrix(nd,e.coordinateSystem,e.reversedDepth);let r=this._frameExtents,o=s?s.z/r.x:1,a=s?s.w/r.y:1,l=s?s.x/r.x:0,c=s?s.y/r.y:0;e.coordinateSystem===io||e.reversedDepth?t.set(.5*o,0,0,.5*o+l,0,.5*a,0,.5*a+c,0,0,1,0,0,0,0,1):t.set(.5*o,0,0,.5*o+l,0,.5*a,0,.5*a+c,0,0,.5,.5,0,0,0,1),t.multiply(nd)}getViewport(e){return this._viewports[e]}getFrameExtents(){return this._frameExtents}dispose(){this.map&&this.map.dispose(),this.mapPass&&this.mapPass.dispose()}copy(e){return this.camera=e.camera.clone(),this.intensity=e.intensity,this.bias=e.bias,this.radius=e.radius,this.autoUpdate=e.autoUpdate,this.needsUpdate=e.needsUpdate,this.normalBias=e.normalBias,this.blurSamples=e.blurSamples,this.mapSize.copy(e.mapSize),this.mapType=e.mapType,this.biasNode=e.biasNode,this}clone(){return new this.constructor().copy(this)}toJSON(){let e={};return e.intensity=this.intensity,e.bias=this.bias,e.normalBias=this.normalBias,e.radius=this.radius,e.blurSamples=this.blurSamples,e.mapSize=this.mapSize.toArray(),e.mapType=this.mapType,e.camera=this.camera.toJSON(!1).object,delete e.camera.matrix,e}},Yl=new H,$l=new Un,Ki=new H,La=class extends Sn{constructor(){super(),this.isCamera=!0,this.type="Camera",this.matrixWorldInverse=new Bt,this.projectionMatrix=new Bt,this.projectionMatrixInverse=new Bt,this.coordinateSystem=Mi,this._reversedDepth=!1}get reversedDepth(){return this._reversedDepth}copy(e,t){return super.copy(e,t),this.matrixWorldInverse.copy(e.matrixWorldInverse),this.projectionMatrix.copy(e.projectionMatrix),this.projectionMatrixInverse.copy(e.projectionMatrixInverse),this.coordinateSystem=e.coordinateSystem,this}getWorldDirection(e){return super.getWorldDirection(e).negate()}updateMatrixWorld(e){super.updateMatrixWorld(e),this.matrixWorld.decompose(Yl,$l,Ki),Ki.x===1&&Ki.y===1&&Ki.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(Yl,$l,Ki.set(1,1,1)).invert()}updateWorldMatrix(e,t,i=!1){super.updateWorldMatrix(e,t,i),this.matrixWorld.decompose(Yl,$l,Ki),Ki.x===1&&Ki.y===1&&Ki.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(Yl,$l,Ki.set(1,1,1)).invert()}clone(){return new this.constructor().copy(this)}},Ws=new H,Im=new qe,Lm=new qe,jn=class extends La{constructor(e=50,t=1,i=.1,s=2e3){super(),this.isPerspectiveCamera=!0,this.type="PerspectiveCamera",this.fov=e,this.zoom=1,this.near=i,this.far=s,this.focus=10,this.aspect=t,this.view=null,this.filmGauge=35,this.filmOffset=0,this.updateProjectionMatrix()}copy(e,t){return super.copy(e,t),this.fov=e.fov,this.zoom=e.zoom,this.near=e.near,this.far=e.far,this.focus=e.focus,this.aspect=e.aspect,this.view=e.view===null?null:Object.assign({},e.view),this.filmGauge=e.filmGauge,this.filmOffset=e.filmOffset,this}setFocalLength(e){let t=.5*this.getFilmHeight()/e;this.fov=ro*2*Math.atan(t),this.updateProjectionMatrix()}getFocalLength(){let e=Math.tan(eo*.5*this.fov);return .5*this.getFilmHeight()/e}getEffectiveFOV(){return ro*2*Math.atan(Math.tan(eo*.5*this.fov)/this.zoom)}getFilmWidth(){return this.filmGauge*Math.min(this.aspect,1)}getFilmHeight(){return this.filmGauge/Math.max(this.aspect,1)}getViewBounds(e,t,i){Ws.set(-1,-1,.5).applyMatrix4(this.projectionMatrixInverse),t.set(Ws.x,Ws.y).multiplyScalar(-e/Ws.z),Ws.set(1,1,.5).applyMatrix4(this.projectionMatrixInverse),i.set(Ws.x,Ws.y).multiplyScalar(-e/Ws.z)}getViewSize(e,t){return this.getViewBounds(e,Im,Lm),t.subVectors(Lm,Im)}setViewOffset(e,t,i,s,r,o){this.aspect=e/t,this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=e,this.view.fullHeight=t,this.view.offsetX=i,this.view.offsetY=s,this.view.width=r,this.view.height=o,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){let e=this.near,t=e*Math.tan(eo*.5*this.fov)/this.zoom,i=2*t,s=this.aspect*i,r=-.5*s,o=this.view;if(this.view!==null&&this.view.enabled){let l=o.fullWidth,c=o.fullHeight;r+=o.offsetX*s/l,t-=o.offsetY*i/c,s*=o.width/l,i*=o.height/c}let a=this.filmOffset;a!==0&&(r+=e*a/this.getFilmWidth()),this.projectionMatrix.makePerspective(r,r+s,t,t-i,e,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(e){let t=super.toJSON(e);return t.object.fov=this.fov,t.object.zoom=this.zoom,t.object.near=this.near,t.object.far=this.far,t.object.focus=this.focus,t.object.aspect=this.aspect,this.view!==null&&(t.object.view=Object.assign({},this.view)),t.object.filmGauge=this.filmGauge,t.object.filmOffset=this.filmOffset,t}};var Da=class extends La{constructor(e=-1,t=1,i=1,s=-1,r=.1,o=2e3){super(),this.isOrthographicCamera=!0,this.type="OrthographicCamera",this.zoom=1,this.view=null,this.left=e,this.right=t,this.top=i,this.bottom=s,this.near=r,this.far=o,this.updateProjectionMatrix()}copy(e,t){return super.copy(e,t),this.left=e.left,this.right=e.right,this.top=e.top,this.bottom=e.bottom,this.near=e.near,this.far=e.far,this.zoom=e.zoom,this.view=e.view===null?null:Object.assign({},e.view),this}setViewOffset(e,t,i,s,r,o){this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=e,this.view.fullHeight=t,this.view.offsetX=i,this.view.offsetY=s,this.view.width=r,this.view.height=o,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){let e=(this.right-this.left)/(2*this.zoom),t=(this.top-this.bottom)/(2*this.zoom),i=(this.right+this.left)/2,s=(this.top+this.bottom)/2,r=i-e,o=i+e,a=s+t,l=s-t;if(this.view!==null&&this.view.enabled){let c=(this.right-this.left)/this.view.fullWidth/this.zoom,u=(this.top-this.bottom)/this.view.fullHeight/this.zoom;r+=c*this.view.offsetX,o=r+c*this.view.width,a-=u*this.view.offsetY,l=a-u*this.view.height}this.projectionMatrix.makeOrthographic(r,o,a,l,this.near,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(e){let t=super.toJSON(e);return t.object.zoom=this.zoom,t.object.left=this.left,t.object.right=this.right,t.object.top=this.top,t.object.bottom=this.bottom,t.object.near=this.near,t.object.far=this.far,this.view!==null&&(t.object.view=Object.assign({},this.view)),t}},ld=class extends Rc{constructor(){super(new Da(-5,5,5,-5,.5,500)),this.isDirectionalLightShadow=!0}},Na=class extends Pa{constructor(e,t){super(e,t),this.isDirectionalLight=!0,this.type="DirectionalLight",this.position.copy(Sn.DEFAULT_UP),this.updateMatrix(),this.target=new Sn,this.shadow=new ld}dispose(){super.dispose(),this.shadow.dispose()}copy(e){return super.copy(e),this.target=e.target.clone(),this.shadow=e.shadow.clone(),this}toJSON(e){let t=super.toJSON(e);return t.object.shadow=this.shadow.toJSON(),t.object.target=this.target.uuid,t}};var jr=-90,Qr=1,po=class extends Sn{constructor(e,t,i){super(),this.type="CubeCamera",this.renderTarget=i,this.coordinateSystem=null,this.activeMipmapLevel=0;let s=new jn(jr,Qr,e,t);s.layers=this.layers,this.add(s);let r=new jn(jr,Qr,e,t);r.layers=this.layers,this.add(r);let o=new jn(jr,Qr,e,t);o.layers=this.layers,this.add(o);let a=new jn(jr,Qr,e,t);a.layers=this.layers,this.add(a);let l=new jn(jr,Qr,e,t);l.layers=this.layers,this.add(l);let c=new jn(jr,Qr,e,t);c.layers=this.layers,this.add(c)}updateCoordinateSystem(){let e=this.coordinateSystem,t=this.children.concat(),[i,s,r,o,a,l]=t;for(let c of t)this.remove(c);if(e===Mi)i.up.set(0,1,0),i.lookAt(1,0,0),s.up.set(0,1,0),s.lookAt(-1,0,0),r.up.set(0,0,-1),r.lookAt(0,1,0),o.up.set(0,0,1),o.lookAt(0,-1,0),a.up.set(0,1,0),a.lookAt(0,0,1),l.up.set(0,1,0),l.lookAt(0,0,-1);else if(e===io)i.up.set(0,-1,0),i.lookAt(-1,0,0),s.up.set(0,-1,0),s.lookAt(1,0,0),r.up.set(0,0,1),r.lookAt(0,1,0),o.up.set(0,0,-1),o.lookAt(0,-1,0),a.up.set(0,-1,0),a.lookAt(0,0,1),l.up.set(0,-1,0),l.lookAt(0,0,-1);else throw new Error("THREE.CubeCamera.updateCoordinateSystem(): Invalid coordinate system: "+e);for(let c of t)this.add(c),c.updateMatrixWorld()}update(e,t){this.parent===null&&this.updateMatrixWorld();let{renderTarget:i,activeMipmapLevel:s}=this;this.coordinateSystem!==e.coordinateSystem&&(this.coordinateSystem=e.coordinateSystem,this.updateCoordinateSystem());let[r,o,a,l,c,u]=this.children,d=e.getRenderTarget(),h=e.getActiveCubeFace(),f=e.getActiveMipmapLevel(),m=e.xr.enabled;e.xr.enabled=!1;let y=i.texture.mipmapsAutoUpdate;i.texture.mipmapsAutoUpdate=!1;let g=!1;e.isWebGLRenderer===!0?g=e.state.buffers.depth.getReversed():g=e.reversedDepthBuffer,e.setRenderTarget(i,0,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,r),e.setRenderTarget(i,1,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,o),e.setRenderTarget(i,2,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,a),e.setRenderTarget(i,3,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,l),e.setRenderTarget(i,4,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,c),i.texture.mipmapsAutoUpdate=y,e.setRenderTarget(i,5,s),g&&e.autoClear===!1&&e.clearDepth(),e.render(t,u),e.setRenderTarget(d,h,f),e.xr.enabled=m,i.texture.needsPMREMUpdate=!0}},Pc=class extends jn{constructor(e=[]){super(),this.isArrayCamera=!0,this.isMultiViewCamera=!1,this.cameras=e,this.perCameraFrustumCulled=!1}};var Wd="\\[\\]\\.:\\/",Bv=new RegExp("["+Wd+"]","g"),Xd="[^"+Wd+"]",zv="[^"+Wd.replace("\\.","")+"]",Vv=/((?:WC+[\/:])*)/.source.replace("WC",Xd),Gv=/(WCOD+)?/.source.replace("WCOD",zv),Hv=/(?:\.(WC+)(?:\[(.+)\])?)?/.source.replace("WC",Xd),Wv=/\.(WC+)(?:\[(.+)\])?/.source.replace("WC",Xd),Xv=new RegExp("^"+Vv+Gv+Hv+Wv+"$"),qv=["material","materials","bones","map"],cd=class{constructor(e,t,i){let s=i||Yt.parseTrackName(t);this._targetGroup=e,this._bindings=e.subscribe_(t,s)}getValue(e,t){this.bind();let i=this._targetGroup.nCachedObjects_,s=this._bindings[i];s!==void 0&&s.getValue(e,t)}setValue(e,t){let i=this._bindings;for(let s=this._targetGroup.nCachedObjects_,r=i.length;s!==r;++s)i[s].setValue(e,t)}bind(){let e=this._bindings;for(let t=this._targetGroup.nCachedObjects_,i=e.length;t!==i;++t)e[t].bind()}unbind(){let e=this._bindings;for(let t=this._targetGroup.nCachedObjects_,i=e.length;t!==i;++t)e[t].unbind()}},Yt=class n{constructor(e,t,i){this.path=t,this.parsedPath=i||n.parseTrackName(t),this.node=n.findNode(e,this.parsedPath.nodeName),this.rootNode=e,this.getValue=this._getValue_unbound,this.setValue=this._setValue_unbound}static create(e,t,i){return e&&e.isAnimationObjectGroup?new n.Composite(e,t,i):new n(e,t,i)}static sanitizeNodeName(e){return e.replace(/\s/g,"_").replace(Bv,"")}static parseTrackName(e){let t=Xv.exec(e);if(t===null)throw new Error("THREE.PropertyBinding: Cannot parse trackName: "+e);let i={nodeName:t[2],objectName:t[3],objectIndex:t[4],propertyName:t[5],propertyIndex:t[6]},s=i.nodeName&&i.nodeName.lastIndexOf(".");if(s!==void 0&&s!==-1){let r=i.nodeName.substring(s+1);qv.indexOf(r)!==-1&&(i.nodeName=i.nodeName.substring(0,s),i.objectName=r)}if(i.propertyName===null||i.propertyName.length===0)throw new Error("THREE.PropertyBinding: can not parse propertyName from trackName: "+e);return i}static findNode(e,t){if(t===void 0||t===""||t==="."||t===-1||t===e.name||t===e.uuid)return e;if(e.skeleton){let i=e.skeleton.getBoneByName(t);if(i!==void 0)return i}if(e.children){let i=function(r){for(let o=0;o<r.length;o++){let a=r[o];if(a.name===t||a.uuid===t)return a;let l=i(a.children);if(l)return l}return null},s=i(e.children);if(s)return s}return null}_getValue_unavailable(){}_setValue_unavailable(){}_getValue_direct(e,t){e[t]=this.targetObject[this.propertyName]}_getValue_array(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)e[t++]=i[s]}_getValue_arrayElement(e,t){e[t]=this.resolvedProperty[this.propertyIndex]}_getValue_toArray(e,t){this.resolvedProperty.toArray(e,t)}_setValue_direct(e,t){this.targetObject[this.propertyName]=e[t]}_setValue_direct_setNeedsUpdate(e,t){this.targetObject[this.propertyName]=e[t],this.targetObject.needsUpdate=!0}_setValue_direct_setMatrixWorldNeedsUpdate(e,t){this.targetObject[this.propertyName]=e[t],this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_array(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)i[s]=e[t++]}_setValue_array_setNeedsUpdate(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)i[s]=e[t++];this.targetObject.needsUpdate=!0}_setValue_array_setMatrixWorldNeedsUpdate(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)i[s]=e[t++];this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_arrayElement(e,t){this.resolvedProperty[this.propertyIndex]=e[t]}_setValue_arrayElement_setNeedsUpdate(e,t){this.resolvedProperty[this.propertyIndex]=e[t],this.targetObject.needsUpdate=!0}_setValue_arrayElement_setMatrixWorldNeedsUpdate(e,t){this.resolvedProperty[this.propertyIndex]=e[t],this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_fromArray(e,t){this.resolvedProperty.fromArray(e,t)}_setValue_fromArray_setNeedsUpdate(e,t){this.resolvedProperty.fromArray(e,t),this.targetObject.needsUpdate=!0}_setValue_fromArray_setMatrixWorldNeedsUpdate(e,t){this.resolvedProperty.fromArray(e,t),this.targetObject.matrixWorldNeedsUpdate=!0}_getValue_unbound(e,t){this.bind(),this.getValue(e,t)}_setValue_unbound(e,t){this.bind(),this.setValue(e,t)}bind(){let e=this.node,t=this.parsedPath,i=t.objectName,s=t.propertyName,r=t.propertyIndex;if(e||(e=n.findNode(this.rootNode,t.nodeName),this.node=e),this.getValue=this._getValue_unavailable,this.setValue=this._setValue_unavailable,!e){$e("PropertyBinding: No target node found for track: "+this.path+".");return}if(i){let c=t.objectIndex;switch(i){case"materials":if(!e.material){Qe("PropertyBinding: Can not bind to material as node does not have a material.",this);return}if(!e.material.materials){Qe("PropertyBinding: Can not bind to material.materials as node.material does not have a materials array.",this);return}e=e.material.materials;break;case"bones":if(!e.skeleton){Qe("PropertyBinding: Can not bind to bones as node does not have a skeleton.",this);return}e=e.skeleton.bones;for(let u=0;u<e.length;u++)if(e[u].name===c){c=u;break}break;case"map":if("map"in e){e=e.map;break}if(!e.material){Qe("PropertyBinding: Can not bind to material as node does not have a material.",this);return}if(!e.material.map){Qe("PropertyBinding: Can not bind to material.map as node.material does not have a map.",this);return}e=e.material.map;break;default:if(e[i]===void 0){Qe("PropertyBinding: Can not bind to objectName of node undefined.",this);return}e=e[i]}if(c!==void 0){if(e[c]===void 0){Qe("PropertyBinding: Trying to bind to objectIndex of objectName, but is undefined.",this,e);return}e=e[c]}}let o=e[s];if(o===void 0){let c=t.nodeName;Qe("PropertyBinding: Trying to update property for track: "+c+"."+s+" but it wasn't found.",e);return}let a=this.Versioning.None;this.targetObject=e,e.isMaterial===!0?a=this.Versioning.NeedsUpdate:e.isObject3D===!0&&(a=this.Versioning.MatrixWorldNeedsUpdate);let l=this.BindingType.Direct;if(r!==void 0){if(s==="morphTargetInfluences"){if(!e.geometry){Qe("PropertyBinding: Can not bind to morphTargetInfluences because node does not have a geometry.",this);return}if(!e.geometry.morphAttributes){Qe("PropertyBinding: Can not bind to morphTargetInfluences because node does not have a geometry.morphAttributes.",this);return}e.morphTargetDictionary[r]!==void 0&&(r=e.morphTargetDictionary[r])}l=this.BindingType.ArrayElement,this.resolvedProperty=o,this.propertyIndex=r}else o.fromArray!==void 0&&o.toArray!==void 0?(l=this.BindingType.HasFromToArray,this.resolvedProperty=o):Array.isArray(o)?(l=this.BindingType.EntireArray,this.resolvedProperty=o):this.propertyName=s;this.getValue=this.GetterByBindingType[l],this.setValue=this.SetterByBindingTypeAndVersioning[l][a]}unbind(){this.node=null,this.getValue=this._getValue_unbound,this.setValue=this._setValue_unbound}};Yt.Composite=cd;Yt.prototype.BindingType={Direct:0,EntireArray:1,ArrayElement:2,HasFromToArray:3};Yt.prototype.Versioning={None:0,NeedsUpdate:1,MatrixWorldNeedsUpdate:2};Yt.prototype.GetterByBindingType=[Yt.prototype._getValue_direct,Yt.prototype._getValue_array,Yt.prototype._getValue_arrayElement,Yt.prototype._getValue_toArray];Yt.prototype.SetterByBindingTypeAndVersioning=[[Yt.prototype._setValue_direct,Yt.prototype._setValue_direct_setNeedsUpdate,Yt.prototype._setValue_direct_setMatrixWorldNeedsUpdate],[Yt.prototype._setValue_array,Yt.prototype._setValue_array_setNeedsUpdate,Yt.prototype._setValue_array_setMatrixWorldNeedsUpdate],[Yt.prototype._setValue_arrayElement,Yt.prototype._setValue_arrayElement_setNeedsUpdate,Yt.prototype._setValue_arrayElement_setMatrixWorldNeedsUpdate],[Yt.prototype._setValue_fromArray,Yt.prototype._setValue_fromArray_setNeedsUpdate,Yt.prototype._setValue_fromArray_setMatrixWorldNeedsUpdate]];var GA=new Float32Array(1);var mo=class{constructor(e=1,t=0,i=0){this.radius=e,this.phi=t,this.theta=i}set(e,t,i){return this.radius=e,this.phi=t,this.theta=i,this}copy(e){return this.radius=e.radius,this.phi=e.phi,this.theta=e.theta,this}makeSafe(){return this.phi=mt(this.phi,1e-6,Math.PI-1e-6),this}setFromVector3(e){return this.setFromCartesianCoords(e.x,e.y,e.z)}setFromCartesianCoords(e,t,i){return this.radius=Math.sqrt(e*e+t*t+i*i),this.radius===0?(this.theta=0,this.phi=0):(this.theta=Math.atan2(e,i),this.phi=Math.acos(mt(t/this.radius,-1,1))),this}clone(){return new this.constructor().copy(this)}};var ud=class{static{this.prototype.isMatrix2=!0}constructor(e,t,i,s){this.elements=[1,0,0,1],e!==void 0&&this.set(e,t,i,s)}identity(){return this.set(1,0,0,1),this}fromArray(e,t=0){for(let i=0;i<4;i++)this.elements[i]=e[i+t];return this}set(e,t,i,s){let r=this.elements;return r[0]=e,r[2]=t,r[1]=i,r[3]=s,this}};var go=class extends uo{constructor(e=10,t=10,i=4473924,s=8947848){i=new tt(i),s=new tt(s);let r=t/2,o=e/t,a=e/2,l=[],c=[];for(let h=0,f=0,m=-a;h<=t;h++,m+=o){l.push(-a,0,m,a,0,m),l.push(m,0,-a,m,0,a);let y=h===r?i:s;y.toArray(c,f),f+=3,y.toArray(c,f),f+=3,y.toArray(c,f),f+=3,y.toArray(c,f),f+=3}let u=new Bn;u.setAttribute("position",new en(l,3)),u.setAttribute("color",new en(c,3));let d=new es({vertexColors:!0,toneMapped:!1});super(u,d),this.type="GridHelper"}dispose(){super.dispose(),this.geometry.dispose(),this.material.dispose()}};var Ua=class extends Ui{constructor(e,t=null){super(),this.object=e,this.domElement=t,this.enabled=!0,this.state=-1,this.keys={},this.mouseButtons={LEFT:null,MIDDLE:null,RIGHT:null},this.touches={ONE:null,TWO:null}}connect(e){this.domElement!==null&&this.disconnect(),this.domElement=e}disconnect(){}dispose(){}update(){}};function qd(n,e,t,i){let s=Yv(i);switch(t){case Pd:return n*e;case Ld:return n*e/s.components*s.byteLength;case Fc:return n*e/s.components*s.byteLength;case er:return n*e*2/s.components*s.byteLength;case kc:return n*e*2/s.components*s.byteLength;case Id:return n*e*3/s.components*s.byteLength;case zi:return n*e*4/s.components*s.byteLength;case Bc:return n*e*4/s.components*s.byteLength;case ka:case Ba:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*8;case za:case Va:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case Vc:case Hc:return Math.max(n,16)*Math.max(e,8)/4;case zc:case Gc:return Math.max(n,8)*Math.max(e,8)/2;case Wc:case Xc:case Yc:case $c:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*8;case qc:case Ga:case Zc:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case Jc:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case Kc:return Math.floor((n+4)/5)*Math.floor((e+3)/4)*16;case jc:return Math.floor((n+4)/5)*Math.floor((e+4)/5)*16;case Qc:return Math.floor((n+5)/6)*Math.floor((e+4)/5)*16;case eu:return Math.floor((n+5)/6)*Math.floor((e+5)/6)*16;case tu:return Math.floor((n+7)/8)*Math.floor((e+4)/5)*16;case nu:return Math.floor((n+7)/8)*Math.floor((e+5)/6)*16;case iu:return Math.floor((n+7)/8)*Math.floor((e+7)/8)*16;case su:return Math.floor((n+9)/10)*Math.floor((e+4)/5)*16;case ru:return Math.floor((n+9)/10)*Math.floor((e+5)/6)*16;case ou:return Math.floor((n+9)/10)*Math.floor((e+7)/8)*16;case au:return Math.floor((n+9)/10)*Math.floor((e+9)/10)*16;case lu:return Math.floor((n+11)/12)*Math.floor((e+9)/10)*16;case cu:return Math.floor((n+11)/12)*Math.floor((e+11)/12)*16;case uu:case hu:case du:return Math.ceil(n/4)*Math.ceil(e/4)*16;case fu:case pu:return Math.ceil(n/4)*Math.ceil(e/4)*8;case Ha:case mu:return Math.ceil(n/4)*Math.ceil(e/4)*16}throw new Error(`Unable to determine texture byte length for ${t} format.`)}function Yv(n){switch(n){case oi:case Ed:return{byteLength:1,components:1};case yo:case Ad:case Bi:return{byteLength:2,components:1};case Uc:case Oc:return{byteLength:2,components:4};case Fi:case Nc:case ki:return{byteLength:4,components:1};case Cd:case Rd:return{byteLength:4,components:3}}throw new Error(`THREE.TextureUtils: Unknown texture type ${n}.`)}typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("register",{detail:{revision:"187"}}));typeof window<"u"&&(window.__THREE__?$e("WARNING: Multiple instances of Three.js being imported."):window.__THREE__="187");function Vg(){let n=null,e=!1,t=null,i=null;function s(r,o){i=n.requestAnimationFrame(s),t(r,o)}return{start:function(){e!==!0&&t!==null&&n!==null&&(i=n.requestAnimationFrame(s),e=!0)},stop:function(){n!==null&&n.cancelAnimationFrame(i),e=!1},setAnimationLoop:function(r){t=r},setContext:function(r){n=r}}}function Zv(n){let e=new WeakMap;function t(a,l){let c=a.array,u=a.usage,d=c.byteLength,h=n.createBuffer();n.bindBuffer(l,h),n.bufferData(l,c,u),a.onUploadCallback();let f;if(c instanceof Float32Array)f=n.FLOAT;else if(typeof Float16Array<"u"&&c instanceof Float16Array)f=n.HALF_FLOAT;else if(c instanceof Uint16Array)a.isFloat16BufferAttribute?f=n.HALF_FLOAT:f=n.UNSIGNED_SHORT;else if(c instanceof Int16Array)f=n.SHORT;else if(c instanceof Uint32Array)f=n.UNSIGNED_INT;else if(c instanceof Int32Array)f=n.INT;else if(c instanceof Int8Array)f=n.BYTE;else if(c instanceof Uint8Array)f=n.UNSIGNED_BYTE;else if(c instanceof Uint8ClampedArray)f=n.UNSIGNED_BYTE;else throw new Error("THREE.WebGLAttributes: Unsupported buffer data format: "+c);return{buffer:h,type:f,bytesPerElement:c.BYTES_PER_ELEMENT,version:a.version,size:d}}function i(a,l,c){let u=l.array,d=l.updateRanges;if(n.bindBuffer(c,a),d.length===0)n.bufferSubData(c,0,u);else{d.sort((f,m)=>f.start-m.start);let h=0;for(let f=1;f<d.length;f++){let m=d[h],y=d[f];y.start<=m.start+m.count+1?m.count=Math.max(m.count,y.start+y.count-m.start):(++h,d[h]=y)}d.length=h+1;for(let f=0,m=d.length;f<m;f++){let y=d[f];n.bufferSubData(c,y.start*u.BYTES_PER_ELEMENT,u,y.start,y.count)}l.clearUpdateRanges()}l.onUploadCallback()}function s(a){return a.isInterleavedBufferAttribute&&(a=a.data),e.get(a)}function r(a){a.isInterleavedBufferAttribute&&(a=a.data);let l=e.get(a);l&&(n.deleteBuffer(l.buffer),e.delete(a))}function o(a,l){if(a.isInterleavedBufferAttribute&&(a=a.data),a.isGLBufferAttribute){let u=e.get(a);(!u||u.version<a.version)&&e.set(a,{buffer:a.buffer,type:a.type,bytesPerElement:a.elementSize,version:a.version});return}let c=e.get(a);if(c===void 0)e.set(a,t(a,l));else if(c.version<a.version){if(c.size!==a.array.byteLength)throw new Error("THREE.WebGLAttributes: The size of the buffer attribute's array buffer does not match the original size. Resizing buffer attributes is not supported.");i(c.buffer,a,l),c.version=a.version}}return{get:s,remove:r,update:o}}var Jv=`#ifdef USE_ALPHAHASH
	if ( diffuseColor.a < getAlphaHashThreshold( vPosition ) ) discard;
#endif`,Kv=`#ifdef USE_ALPHAHASH
	const float ALPHA_HASH_SCALE = 0.05;
	float hash2D( vec2 value ) {
		return fract( 1.0e4 * sin( 17.0 * value.x + 0.1 * value.y ) * ( 0.1 + abs( sin( 13.0 * value.y + value.x ) ) ) );
	}
	float hash3D( vec3 value ) {
		return hash2D( vec2( hash2D( value.xy ), value.z ) );
	}
	float getAlphaHashThreshold( vec3 position ) {
		float maxDeriv = max(
			length( dFdx( position.xyz ) ),
			length( dFdy( position.xyz ) )
		);
		float pixScale = 1.0 / ( ALPHA_HASH_SCALE * maxDeriv );
		vec2 pixScales = vec2(
			exp2( floor( log2( pixScale ) ) ),
			exp2( ceil( log2( pixScale ) ) )
		);
		vec2 alpha = vec2(
			hash3D( floor( pixScales.x * position.xyz ) ),
			hash3D( floor( pixScales.y * position.xyz ) )
		);
		float lerpFactor = fract( log2( pixScale ) );
		float x = ( 1.0 - lerpFactor ) * alpha.x + lerpFactor * alpha.y;
		float a = min( lerpFactor, 1.0 - lerpFactor );
		vec3 cases = vec3(
			x * x / ( 2.0 * a * ( 1.0 - a ) ),
			( x - 0.5 * a ) / ( 1.0 - a ),
			1.0 - ( ( 1.0 - x ) * ( 1.0 - x ) / ( 2.0 * a * ( 1.0 - a ) ) )
		);
		float threshold = ( x < ( 1.0 - a ) )
			? ( ( x < a ) ? cases.x : cases.y )
			: cases.z;
		return clamp( threshold , 1.0e-6, 1.0 );
	}
#endif`,jv=`#ifdef USE_ALPHAMAP
	diffuseColor.a *= texture2D( alphaMap, vAlphaMapUv ).g;
#endif`,Qv=`#ifdef USE_ALPHAMAP
	uniform sampler2D alphaMap;
#endif`,ey=`#ifdef USE_ALPHATEST
	#ifdef ALPHA_TO_COVERAGE
	diffuseColor.a = smoothstep( alphaTest, alphaTest + fwidth( diffuseColor.a ), diffuseColor.a );
	if ( diffuseColor.a == 0.0 ) discard;
	#else
	if ( diffuseColor.a < alphaTest ) discard;
	#endif
#endif`,ty=`#ifdef USE_ALPHATEST
	uniform float alphaTest;
#endif`,ny=`#ifdef USE_AOMAP
	float ambientOcclusion = ( texture2D( aoMap, vAoMapUv ).r - 1.0 ) * aoMapIntensity + 1.0;
	reflectedLight.indirectDiffuse *= ambientOcclusion;
	#if defined( USE_CLEARCOAT ) 
		clearcoatSpecularIndirect *= ambientOcclusion;
	#endif
	#if defined( USE_SHEEN ) 
		sheenSpecularIndirect *= ambientOcclusion;
	#endif
	#if defined( USE_ENVMAP ) && defined( STANDARD )
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		reflectedLight.indirectSpecular *= computeSpecularOcclusion( dotNV, ambientOcclusion, material.roughness );
	#endif
#endif`,iy=`#ifdef USE_AOMAP
	uniform sampler2D aoMap;
	uniform float aoMapIntensity;
#endif`,sy=`#ifdef USE_BATCHING
	#if ! defined( GL_ANGLE_multi_draw )
	#define gl_DrawID _gl_DrawID
	uniform int _gl_DrawID;
	#endif
	uniform highp sampler2D batchingTexture;
	uniform highp usampler2D batchingIdTexture;
	mat4 getBatchingMatrix( const in float i ) {
		int size = textureSize( batchingTexture, 0 ).x;
		int j = int( i ) * 4;
		int x = j % size;
		int y = j / size;
		vec4 v1 = texelFetch( batchingTexture, ivec2( x, y ), 0 );
		vec4 v2 = texelFetch( batchingTexture, ivec2( x + 1, y ), 0 );
		vec4 v3 = texelFetch( batchingTexture, ivec2( x + 2, y ), 0 );
		vec4 v4 = texelFetch( batchingTexture, ivec2( x + 3, y ), 0 );
		return mat4( v1, v2, v3, v4 );
	}
	float getIndirectIndex( const in int i ) {
		int size = textureSize( batchingIdTexture, 0 ).x;
		int x = i % size;
		int y = i / size;
		return float( texelFetch( batchingIdTexture, ivec2( x, y ), 0 ).r );
	}
#endif
#ifdef USE_BATCHING_COLOR
	uniform sampler2D batchingColorTexture;
	vec4 getBatchingColor( const in float i ) {
		int size = textureSize( batchingColorTexture, 0 ).x;
		int j = int( i );
		int x = j % size;
		int y = j / size;
		return texelFetch( batchingColorTexture, ivec2( x, y ), 0 );
	}
#endif`,ry=`#ifdef USE_BATCHING
	mat4 batchingMatrix = getBatchingMatrix( getIndirectIndex( gl_DrawID ) );
#endif`,oy=`vec3 transformed = vec3( position );
#ifdef USE_ALPHAHASH
	vPosition = vec3( position );
#endif`,ay=`vec3 objectNormal = vec3( normal );
#ifdef USE_TANGENT
	vec3 objectTangent = vec3( tangent.xyz );
#endif`,ly=`float G_BlinnPhong_Implicit( ) {
	return 0.25;
}
float D_BlinnPhong( const in float shininess, const in float dotNH ) {
	return RECIPROCAL_PI * ( shininess * 0.5 + 1.0 ) * pow( dotNH, shininess );
}
vec3 BRDF_BlinnPhong( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in vec3 specularColor, const in float shininess ) {
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNH = saturate( dot( normal, halfDir ) );
	float dotVH = saturate( dot( viewDir, halfDir ) );
	vec3 F = F_Schlick( specularColor, 1.0, dotVH );
	float G = G_BlinnPhong_Implicit( );
	float D = D_BlinnPhong( shininess, dotNH );
	return F * ( G * D );
} // validated`,cy=`#ifdef USE_IRIDESCENCE
	const mat3 XYZ_TO_REC709 = mat3(
		 3.2404542, -0.9692660,  0.0556434,
		-1.5371385,  1.8760108, -0.2040259,
		-0.4985314,  0.0415560,  1.0572252
	);
	vec3 Fresnel0ToIor( vec3 fresnel0 ) {
		vec3 sqrtF0 = sqrt( fresnel0 );
		return ( vec3( 1.0 ) + sqrtF0 ) / ( vec3( 1.0 ) - sqrtF0 );
	}
	vec3 IorToFresnel0( vec3 transmittedIor, float incidentIor ) {
		return pow2( ( transmittedIor - vec3( incidentIor ) ) / ( transmittedIor + vec3( incidentIor ) ) );
	}
	float IorToFresnel0( float transmittedIor, float incidentIor ) {
		return pow2( ( transmittedIor - incidentIor ) / ( transmittedIor + incidentIor ));
	}
	vec3 evalSensitivity( float OPD, vec3 shift ) {
		float phase = 2.0 * PI * OPD * 1.0e-9;
		vec3 val = vec3( 5.4856e-13, 4.4201e-13, 5.2481e-13 );
		vec3 pos = vec3( 1.6810e+06, 1.7953e+06, 2.2084e+06 );
		vec3 var = vec3( 4.3278e+09, 9.3046e+09, 6.6121e+09 );
		vec3 xyz = val * sqrt( 2.0 * PI * var ) * cos( pos * phase + shift ) * exp( - pow2( phase ) * var );
		xyz.x += 9.7470e-14 * sqrt( 2.0 * PI * 4.5282e+09 ) * cos( 2.2399e+06 * phase + shift[ 0 ] ) * exp( - 4.5282e+09 * pow2( phase ) );
		xyz /= 1.0685e-7;
		vec3 rgb = XYZ_TO_REC709 * xyz;
		return rgb;
	}
	vec3 evalIridescence( float outsideIOR, float eta2, float cosTheta1, float thinFilmThickness, vec3 baseF0 ) {
		vec3 I;
		float iridescenceIOR = mix( outsideIOR, eta2, smoothstep( 0.0, 0.03, thinFilmThickness ) );
		float sinTheta2Sq = pow2( outsideIOR / iridescenceIOR ) * ( 1.0 - pow2( cosTheta1 ) );
		float cosTheta2Sq = 1.0 - sinTheta2Sq;
		if ( cosTheta2Sq < 0.0 ) {
			return vec3( 1.0 );
		}
		float cosTheta2 = sqrt( cosTheta2Sq );
		float R0 = IorToFresnel0( iridescenceIOR, outsideIOR );
		float R12 = F_Schlick( R0, 1.0, cosTheta1 );
		float T121 = 1.0 - R12;
		float phi12 = 0.0;
		if ( iridescenceIOR < outsideIOR ) phi12 = PI;
		float phi21 = PI - phi12;
		vec3 baseIOR = Fresnel0ToIor( clamp( baseF0, 0.0, 0.9999 ) );		vec3 R1 = IorToFresnel0( baseIOR, iridescenceIOR );
		vec3 R23 = F_Schlick( R1, 1.0, cosTheta2 );
		vec3 phi23 = vec3( 0.0 );
		if ( baseIOR[ 0 ] < iridescenceIOR ) phi23[ 0 ] = PI;
		if ( baseIOR[ 1 ] < iridescenceIOR ) phi23[ 1 ] = PI;
		if ( baseIOR[ 2 ] < iridescenceIOR ) phi23[ 2 ] = PI;
		float OPD = 2.0 * iridescenceIOR * thinFilmThickness * cosTheta2;
		vec3 phi = vec3( phi21 ) + phi23;
		vec3 R123 = clamp( R12 * R23, 1e-5, 0.9999 );
		vec3 r123 = sqrt( R123 );
		vec3 Rs = pow2( T121 ) * R23 / ( vec3( 1.0 ) - R123 );
		vec3 C0 = R12 + Rs;
		I = C0;
		vec3 Cm = Rs - T121;
		for ( int m = 1; m <= 2; ++ m ) {
			Cm *= r123;
			vec3 Sm = 2.0 * evalSensitivity( float( m ) * OPD, float( m ) * phi );
			I += Cm * Sm;
		}
		return max( I, vec3( 0.0 ) );
	}
#endif`,uy=`#ifdef USE_BUMPMAP
	uniform sampler2D bumpMap;
	uniform float bumpScale;
	vec2 dHdxy_fwd() {
		vec2 dSTdx = dFdx( vBumpMapUv );
		vec2 dSTdy = dFdy( vBumpMapUv );
		float Hll = bumpScale * texture2D( bumpMap, vBumpMapUv ).x;
		float dBx = bumpScale * texture2D( bumpMap, vBumpMapUv + dSTdx ).x - Hll;
		float dBy = bumpScale * texture2D( bumpMap, vBumpMapUv + dSTdy ).x - Hll;
		return vec2( dBx, dBy );
	}
	vec3 perturbNormalArb( vec3 surf_pos, vec3 surf_norm, vec2 dHdxy, float faceDirection ) {
		vec3 vSigmaX = normalize( dFdx( surf_pos.xyz ) );
		vec3 vSigmaY = normalize( dFdy( surf_pos.xyz ) );
		vec3 vN = surf_norm;
		vec3 R1 = cross( vSigmaY, vN );
		vec3 R2 = cross( vN, vSigmaX );
		float fDet = dot( vSigmaX, R1 ) * faceDirection;
		vec3 vGrad = sign( fDet ) * ( dHdxy.x * R1 + dHdxy.y * R2 );
		return normalize( abs( fDet ) * surf_norm - vGrad );
	}
#endif`,hy=`#if NUM_CLIPPING_PLANES > 0
	vec4 plane;
	#ifdef ALPHA_TO_COVERAGE
		float distanceToPlane, distanceGradient;
		float clipOpacity = 1.0;
		#pragma unroll_loop_start
		for ( int i = 0; i < UNION_CLIPPING_PLANES; i ++ ) {
			plane = clippingPlanes[ i ];
			distanceToPlane = - dot( vClipPosition, plane.xyz ) + plane.w;
			distanceGradient = fwidth( distanceToPlane ) / 2.0;
			clipOpacity *= smoothstep( - distanceGradient, distanceGradient, distanceToPlane );
			if ( clipOpacity == 0.0 ) discard;
		}
		#pragma unroll_loop_end
		#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
			float unionClipOpacity = 1.0;
			#pragma unroll_loop_start
			for ( int i = UNION_CLIPPING_PLANES; i < NUM_CLIPPING_PLANES; i ++ ) {
				plane = clippingPlanes[ i ];
				distanceToPlane = - dot( vClipPosition, plane.xyz ) + plane.w;
				distanceGradient = fwidth( distanceToPlane ) / 2.0;
				unionClipOpacity *= 1.0 - smoothstep( - distanceGradient, distanceGradient, distanceToPlane );
			}
			#pragma unroll_loop_end
			clipOpacity *= 1.0 - unionClipOpacity;
		#endif
		diffuseColor.a *= clipOpacity;
		if ( diffuseColor.a == 0.0 ) discard;
	#else
		#pragma unroll_loop_start
		for ( int i = 0; i < UNION_CLIPPING_PLANES; i ++ ) {
			plane = clippingPlanes[ i ];
			if ( dot( vClipPosition, plane.xyz ) > plane.w ) discard;
		}
		#pragma unroll_loop_end
		#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
			bool clipped = true;
			#pragma unroll_loop_start
			for ( int i = UNION_CLIPPING_PLANES; i < NUM_CLIPPING_PLANES; i ++ ) {
				plane = clippingPlanes[ i ];
				clipped = ( dot( vClipPosition, plane.xyz ) > plane.w ) && clipped;
			}
			#pragma unroll_loop_end
			if ( clipped ) discard;
		#endif
	#endif
#endif`,dy=`#if NUM_CLIPPING_PLANES > 0
	varying vec3 vClipPosition;
	uniform vec4 clippingPlanes[ NUM_CLIPPING_PLANES ];
#endif`,fy=`#if NUM_CLIPPING_PLANES > 0
	varying vec3 vClipPosition;
#endif`,py=`#if NUM_CLIPPING_PLANES > 0
	vClipPosition = - mvPosition.xyz;
#endif`,my=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
	diffuseColor *= vColor;
#endif`,gy=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
	varying vec4 vColor;
#endif`,_y=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
	varying vec4 vColor;
#endif`,xy=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
	vColor = vec4( 1.0 );
#endif
#ifdef USE_COLOR_ALPHA
	vColor *= color;
#elif defined( USE_COLOR )
	vColor.rgb *= color;
#endif
#ifdef USE_INSTANCING_COLOR
	vColor.rgb *= instanceColor.rgb;
#endif
#ifdef USE_BATCHING_COLOR
	vColor *= getBatchingColor( getIndirectIndex( gl_DrawID ) );
#endif`,vy=`#define PI 3.141592653589793
#define PI2 6.283185307179586
#define PI_HALF 1.5707963267948966
#define RECIPROCAL_PI 0.3183098861837907
#define RECIPROCAL_PI2 0.15915494309189535
#define EPSILON 1e-6
#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
#define whiteComplement( a ) ( 1.0 - saturate( a ) )
float pow2( const in float x ) { return x*x; }
vec3 pow2( const in vec3 x ) { return x*x; }
float pow3( const in float x ) { return x*x*x; }
float pow4( const in float x ) { float x2 = x*x; return x2*x2; }
float max3( const in vec3 v ) { return max( max( v.x, v.y ), v.z ); }
float average( const in vec3 v ) { return dot( v, vec3( 0.3333333 ) ); }
highp float rand( const in vec2 uv ) {
	const highp float a = 12.9898, b = 78.233, c = 43758.5453;
	highp float dt = dot( uv.xy, vec2( a,b ) ), sn = mod( dt, PI );
	return fract( sin( sn ) * c );
}
#ifdef HIGH_PRECISION
	float precisionSafeLength( vec3 v ) { return length( v ); }
#else
	float precisionSafeLength( vec3 v ) {
		float maxComponent = max3( abs( v ) );
		return length( v / maxComponent ) * maxComponent;
	}
#endif
struct IncidentLight {
	vec3 color;
	vec3 direction;
	bool visible;
};
struct ReflectedLight {
	vec3 directDiffuse;
	vec3 directSpecular;
	vec3 indirectDiffuse;
	vec3 indirectSpecular;
};
#ifdef USE_ALPHAHASH
	varying vec3 vPosition;
#endif
vec3 transformDirection( in vec3 dir, in mat4 matrix ) {
	return normalize( ( matrix * vec4( dir, 0.0 ) ).xyz );
}
#define inverseTransformDirection transformDirectionByInverseViewMatrix
vec3 transformNormalByInverseViewMatrix( in vec3 normal, in mat4 viewMatrix ) {
	return normalize( ( vec4( normal, 0.0 ) * viewMatrix ).xyz );
}
vec3 transformDirectionByInverseViewMatrix( in vec3 dir, in mat4 viewMatrix ) {
	return normalize( ( vec4( dir, 0.0 ) * viewMatrix ).xyz );
}
bool isPerspectiveMatrix( mat4 m ) {
	return m[ 2 ][ 3 ] == - 1.0;
}
vec2 equirectUv( in vec3 dir ) {
	float u = atan( dir.z, dir.x ) * RECIPROCAL_PI2 + 0.5;
	float v = asin( clamp( dir.y, - 1.0, 1.0 ) ) * RECIPROCAL_PI + 0.5;
	return vec2( u, v );
}
vec3 BRDF_Lambert( const in vec3 diffuseColor ) {
	return RECIPROCAL_PI * diffuseColor;
}
vec3 F_Schlick( const in vec3 f0, const in float f90, const in float dotVH ) {
	float fresnel = exp2( ( - 5.55473 * dotVH - 6.98316 ) * dotVH );
	return f0 * ( 1.0 - fresnel ) + ( f90 * fresnel );
}
float F_Schlick( const in float f0, const in float f90, const in float dotVH ) {
	float fresnel = exp2( ( - 5.55473 * dotVH - 6.98316 ) * dotVH );
	return f0 * ( 1.0 - fresnel ) + ( f90 * fresnel );
} // validated`,yy=`vec3 transformedNormal = objectNormal;
#ifdef USE_TANGENT
	vec3 transformedTangent = objectTangent;
#endif
#ifdef USE_BATCHING
	mat3 bm = mat3( batchingMatrix );
	transformedNormal /= vec3( dot( bm[ 0 ], bm[ 0 ] ), dot( bm[ 1 ], bm[ 1 ] ), dot( bm[ 2 ], bm[ 2 ] ) );
	transformedNormal = bm * transformedNormal;
	#ifdef USE_TANGENT
		transformedTangent = bm * transformedTangent;
	#endif
#endif
#ifdef USE_INSTANCING
	mat3 im = mat3( instanceMatrix );
	transformedNormal /= vec3( dot( im[ 0 ], im[ 0 ] ), dot( im[ 1 ], im[ 1 ] ), dot( im[ 2 ], im[ 2 ] ) );
	transformedNormal = im * transformedNormal;
	#ifdef USE_TANGENT
		transformedTangent = im * transformedTangent;
	#endif
#endif
transformedNormal = normalMatrix * transformedNormal;
#ifdef FLIP_SIDED
	transformedNormal = - transformedNormal;
#endif
#ifdef USE_TANGENT
	transformedTangent = ( modelViewMatrix * vec4( transformedTangent, 0.0 ) ).xyz;
#endif`,by=`#ifdef USE_DISPLACEMENTMAP
	uniform sampler2D displacementMap;
	uniform float displacementScale;
	uniform float displacementBias;
#endif`,Sy=`#ifdef USE_DISPLACEMENTMAP
	transformed += normalize( objectNormal ) * ( texture2D( displacementMap, vDisplacementMapUv ).x * displacementScale + displacementBias );
#endif`,My=`#ifdef USE_EMISSIVEMAP
	vec4 emissiveColor = texture2D( emissiveMap, vEmissiveMapUv );
	#ifdef DECODE_VIDEO_TEXTURE_EMISSIVE
		emissiveColor = sRGBTransferEOTF( emissiveColor );
	#endif
	totalEmissiveRadiance *= emissiveColor.rgb;
#endif`,wy=`#ifdef USE_EMISSIVEMAP
	uniform sampler2D emissiveMap;
#endif`,Ty="gl_FragColor = linearToOutputTexel( gl_FragColor );",Ey=`vec4 LinearTransferOETF( in vec4 value ) {
	return value;
}
vec4 sRGBTransferEOTF( in vec4 value ) {
	return vec4( mix( pow( value.rgb * 0.9478672986 + vec3( 0.0521327014 ), vec3( 2.4 ) ), value.rgb * 0.0773993808, vec3( lessThanEqual( value.rgb, vec3( 0.04045 ) ) ) ), value.a );
}
vec4 sRGBTransferOETF( in vec4 value ) {
	return vec4( mix( pow( value.rgb, vec3( 0.41666 ) ) * 1.055 - vec3( 0.055 ), value.rgb * 12.92, vec3( lessThanEqual( value.rgb, vec3( 0.0031308 ) ) ) ), value.a );
}`,Ay=`#ifdef USE_ENVMAP
	#ifdef ENV_WORLDPOS
		vec3 cameraToFrag;
		if ( isOrthographic ) {
			cameraToFrag = normalize( vec3( - viewMatrix[ 0 ][ 2 ], - viewMatrix[ 1 ][ 2 ], - viewMatrix[ 2 ][ 2 ] ) );
		} else {
			cameraToFrag = normalize( vWorldPosition - cameraPosition );
		}
		vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
		#ifdef ENVMAP_MODE_REFLECTION
			vec3 reflectVec = reflect( cameraToFrag, worldNormal );
		#else
			vec3 reflectVec = refract( cameraToFrag, worldNormal, refractionRatio );
		#endif
	#else
		vec3 reflectVec = vReflect;
	#endif
	#ifdef ENVMAP_TYPE_CUBE
		vec4 envColor = textureCube( envMap, envMapRotation * reflectVec );
		#ifdef ENVMAP_BLENDING_MULTIPLY
			outgoingLight = mix( outgoingLight, outgoingLight * envColor.xyz, specularStrength * reflectivity );
		#elif defined( ENVMAP_BLENDING_MIX )
			outgoingLight = mix( outgoingLight, envColor.xyz, specularStrength * reflectivity );
		#elif defined( ENVMAP_BLENDING_ADD )
			outgoingLight += envColor.xyz * specularStrength * reflectivity;
		#endif
	#endif
#endif`,Cy=`#ifdef USE_ENVMAP
	uniform float envMapIntensity;
	uniform mat3 envMapRotation;
	uniform samplerCube envMap;
	#ifdef ENVMAP_TYPE_PMREM
		float roughnessToMip( const in float roughness ) {
			float r = clamp( roughness, 0.0, 1.0 );
			return ENVMAP_MAX_LOD * r * ( 2.0 - r );
		}
	#endif
#endif`,Ry=`#ifdef USE_ENVMAP
	uniform float reflectivity;
	#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
		#define ENV_WORLDPOS
	#endif
	#ifdef ENV_WORLDPOS
		varying vec3 vWorldPosition;
		uniform float refractionRatio;
	#else
		varying vec3 vReflect;
	#endif
#endif`,Py=`#ifdef USE_ENVMAP
	#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
		#define ENV_WORLDPOS
	#endif
	#ifdef ENV_WORLDPOS
		
		varying vec3 vWorldPosition;
	#else
		varying vec3 vReflect;
		uniform float refractionRatio;
	#endif
#endif`,Iy=`#ifdef USE_ENVMAP
	#ifdef ENV_WORLDPOS
		vWorldPosition = worldPosition.xyz;
	#else
		vec3 cameraToVertex;
		if ( isOrthographic ) {
			cameraToVertex = normalize( vec3( - viewMatrix[ 0 ][ 2 ], - viewMatrix[ 1 ][ 2 ], - viewMatrix[ 2 ][ 2 ] ) );
		} else {
			cameraToVertex = normalize( worldPosition.xyz - cameraPosition );
		}
		vec3 worldNormal = transformNormalByInverseViewMatrix( transformedNormal, viewMatrix );
		#ifdef ENVMAP_MODE_REFLECTION
			vReflect = reflect( cameraToVertex, worldNormal );
		#else
			vReflect = refract( cameraToVertex, worldNormal, refractionRatio );
		#endif
	#endif
#endif`,Ly=`#ifdef USE_FOG
	vFogDepth = - mvPosition.z;
#endif`,Dy=`#ifdef USE_FOG
	varying float vFogDepth;
#endif`,Ny=`#ifdef USE_FOG
	#ifdef FOG_EXP2
		float fogFactor = 1.0 - exp( - fogDensity * fogDensity * vFogDepth * vFogDepth );
	#else
		float fogFactor = smoothstep( fogNear, fogFar, vFogDepth );
	#endif
	gl_FragColor.rgb = mix( gl_FragColor.rgb, fogColor, fogFactor );
#endif`,Uy=`#ifdef USE_FOG
	uniform vec3 fogColor;
	varying float vFogDepth;
	#ifdef FOG_EXP2
		uniform float fogDensity;
	#else
		uniform float fogNear;
		uniform float fogFar;
	#endif
#endif`,Oy=`#ifdef USE_GRADIENTMAP
	uniform sampler2D gradientMap;
#endif
vec3 getGradientIrradiance( vec3 normal, vec3 lightDirection ) {
	float dotNL = dot( normal, lightDirection );
	vec2 coord = vec2( dotNL * 0.5 + 0.5, 0.0 );
	#ifdef USE_GRADIENTMAP
		return vec3( texture2D( gradientMap, coord ).r );
	#else
		vec2 fw = fwidth( coord ) * 0.5;
		return mix( vec3( 0.7 ), vec3( 1.0 ), smoothstep( 0.7 - fw.x, 0.7 + fw.x, coord.x ) );
	#endif
}`,Fy=`#ifdef USE_LIGHTMAP
	uniform sampler2D lightMap;
	uniform float lightMapIntensity;
#endif`,ky=`LambertMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.specularStrength = specularStrength;`,By=`varying vec3 vViewPosition;
struct LambertMaterial {
	vec3 diffuseColor;
	float specularStrength;
};
void RE_Direct_Lambert( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in LambertMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Lambert( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in LambertMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Lambert
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Lambert`,zy=`uniform bool receiveShadow;
uniform vec3 ambientLightColor;
#if defined( USE_LIGHT_PROBES )
	uniform vec3 lightProbe[ 9 ];
#endif
vec3 shGetIrradianceAt( in vec3 normal, in vec3 shCoefficients[ 9 ] ) {
	float x = normal.x, y = normal.y, z = normal.z;
	vec3 result = shCoefficients[ 0 ] * 0.886227;
	result += shCoefficients[ 1 ] * 2.0 * 0.511664 * y;
	result += shCoefficients[ 2 ] * 2.0 * 0.511664 * z;
	result += shCoefficients[ 3 ] * 2.0 * 0.511664 * x;
	result += shCoefficients[ 4 ] * 2.0 * 0.429043 * x * y;
	result += shCoefficients[ 5 ] * 2.0 * 0.429043 * y * z;
	result += shCoefficients[ 6 ] * ( 0.743125 * z * z - 0.247708 );
	result += shCoefficients[ 7 ] * 2.0 * 0.429043 * x * z;
	result += shCoefficients[ 8 ] * 0.429043 * ( x * x - y * y );
	return result;
}
vec3 getLightProbeIrradiance( const in vec3 lightProbe[ 9 ], const in vec3 normal ) {
	vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
	vec3 irradiance = shGetIrradianceAt( worldNormal, lightProbe );
	return irradiance;
}
vec3 getAmbientLightIrradiance( const in vec3 ambientLightColor ) {
	vec3 irradiance = ambientLightColor;
	return irradiance;
}
float getDistanceAttenuation( const in float lightDistance, const in float cutoffDistance, const in float decayExponent ) {
	float distanceFalloff = 1.0 / max( pow( lightDistance, decayExponent ), 0.01 );
	if ( cutoffDistance > 0.0 ) {
		distanceFalloff *= pow2( saturate( 1.0 - pow4( lightDistance / cutoffDistance ) ) );
	}
	return distanceFalloff;
}
float getSpotAttenuation( const in float coneCosine, const in float penumbraCosine, const in float angleCosine ) {
	return smoothstep( coneCosine, penumbraCosine, angleCosine );
}
#if NUM_SUN_LIGHTS > 0
	struct SunLight {
		vec3 direction;
		vec3 color;
	};
	uniform SunLight sunLights[ NUM_SUN_LIGHTS ];
	void getSunLightInfo( const in SunLight sunLight, out IncidentLight light ) {
		light.color = sunLight.color;
		light.direction = sunLight.direction;
		light.visible = true;
	}
#endif
#if NUM_DIR_LIGHTS > 0
	struct DirectionalLight {
		vec3 direction;
		vec3 color;
	};
	uniform DirectionalLight directionalLights[ NUM_DIR_LIGHTS ];
	void getDirectionalLightInfo( const in DirectionalLight directionalLight, out IncidentLight light ) {
		light.color = directionalLight.color;
		light.direction = directionalLight.direction;
		light.visible = true;
	}
#endif
#if NUM_POINT_LIGHTS > 0
	struct PointLight {
		vec3 position;
		vec3 color;
		float distance;
		float decay;
	};
	uniform PointLight pointLights[ NUM_POINT_LIGHTS ];
	void getPointLightInfo( const in PointLight pointLight, const in vec3 geometryPosition, out IncidentLight light ) {
		vec3 lVector = pointLight.position - geometryPosition;
		light.direction = normalize( lVector );
		float lightDistance = length( lVector );
		light.color = pointLight.color;
		light.color *= getDistanceAttenuation( lightDistance, pointLight.distance, pointLight.decay );
		light.visible = ( light.color != vec3( 0.0 ) );
	}
#endif
#if NUM_SPOT_LIGHTS > 0
	struct SpotLight {
		vec3 position;
		vec3 direction;
		vec3 color;
		float distance;
		float decay;
		float coneCos;
		float penumbraCos;
	};
	uniform SpotLight spotLights[ NUM_SPOT_LIGHTS ];
	void getSpotLightInfo( const in SpotLight spotLight, const in vec3 geometryPosition, out IncidentLight light ) {
		vec3 lVector = spotLight.position - geometryPosition;
		light.direction = normalize( lVector );
		float angleCos = dot( light.direction, spotLight.direction );
		float spotAttenuation = getSpotAttenuation( spotLight.coneCos, spotLight.penumbraCos, angleCos );
		if ( spotAttenuation > 0.0 ) {
			float lightDistance = length( lVector );
			light.color = spotLight.color * spotAttenuation;
			light.color *= getDistanceAttenuation( lightDistance, spotLight.distance, spotLight.decay );
			light.visible = ( light.color != vec3( 0.0 ) );
		} else {
			light.color = vec3( 0.0 );
			light.visible = false;
		}
	}
#endif
#if NUM_RECT_AREA_LIGHTS > 0
	struct RectAreaLight {
		vec3 color;
		vec3 position;
		vec3 halfWidth;
		vec3 halfHeight;
	};
	uniform sampler2D ltc_1;	uniform sampler2D ltc_2;
	uniform RectAreaLight rectAreaLights[ NUM_RECT_AREA_LIGHTS ];
#endif
#if NUM_HEMI_LIGHTS > 0
	struct HemisphereLight {
		vec3 direction;
		vec3 skyColor;
		vec3 groundColor;
	};
	uniform HemisphereLight hemisphereLights[ NUM_HEMI_LIGHTS ];
	vec3 getHemisphereLightIrradiance( const in HemisphereLight hemiLight, const in vec3 normal ) {
		float dotNL = dot( normal, hemiLight.direction );
		float hemiDiffuseWeight = 0.5 * dotNL + 0.5;
		vec3 irradiance = mix( hemiLight.groundColor, hemiLight.skyColor, hemiDiffuseWeight );
		return irradiance;
	}
#endif
#include <lightprobes_pars_fragment>`,Vy=`#ifdef USE_ENVMAP
	vec3 getIBLIrradiance( const in vec3 normal ) {
		#ifdef ENVMAP_TYPE_PMREM
			vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
			vec4 envMapColor = textureLod( envMap, envMapRotation * worldNormal, ENVMAP_MAX_LOD );
			return PI * envMapColor.rgb * envMapIntensity;
		#else
			return vec3( 0.0 );
		#endif
	}
	vec3 getIBLRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness ) {
		#ifdef ENVMAP_TYPE_PMREM
			vec3 reflectVec = reflect( - viewDir, normal );
			reflectVec = normalize( mix( reflectVec, normal, pow4( roughness ) ) );
			reflectVec = transformDirectionByInverseViewMatrix( reflectVec, viewMatrix );
			vec4 envMapColor = textureLod( envMap, envMapRotation * reflectVec, roughnessToMip( roughness ) );
			return envMapColor.rgb * envMapIntensity;
		#else
			return vec3( 0.0 );
		#endif
	}
	#ifdef USE_RETROREFLECTION
		vec3 getIBLRetroRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness ) {
			#ifdef ENVMAP_TYPE_PMREM
				vec3 retroVec = normalize( mix( viewDir, normal, pow4( roughness ) ) );
				retroVec = transformDirectionByInverseViewMatrix( retroVec, viewMatrix );
				vec4 envMapColor = textureLod( envMap, envMapRotation * retroVec, roughnessToMip( roughness ) );
				return envMapColor.rgb * envMapIntensity;
			#else
				return vec3( 0.0 );
			#endif
		}
	#endif
	#ifdef USE_ANISOTROPY
		vec3 getIBLAnisotropyRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness, const in vec3 bitangent, const in float anisotropy ) {
			#ifdef ENVMAP_TYPE_PMREM
				vec3 bentNormal = cross( bitangent, viewDir );
				bentNormal = normalize( cross( bentNormal, bitangent ) );
				bentNormal = normalize( mix( bentNormal, normal, pow2( pow2( 1.0 - anisotropy * ( 1.0 - roughness ) ) ) ) );
				return getIBLRadiance( viewDir, bentNormal, roughness );
			#else
				return vec3( 0.0 );
			#endif
		}
		#ifdef USE_RETROREFLECTION
			vec3 getIBLAnisotropyRetroRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness, const in vec3 bitangent, const in float anisotropy ) {
				#ifdef ENVMAP_TYPE_PMREM
					vec3 bentNormal = cross( bitangent, viewDir );
					bentNormal = normalize( cross( bentNormal, bitangent ) );
					bentNormal = normalize( mix( bentNormal, normal, pow2( pow2( 1.0 - anisotropy * ( 1.0 - roughness ) ) ) ) );
					return getIBLRetroRadiance( viewDir, bentNormal, roughness );
				#else
					return vec3( 0.0 );
				#endif
			}
		#endif
	#endif
#endif`,Gy=`ToonMaterial material;
material.diffuseColor = diffuseColor.rgb;`,Hy=`varying vec3 vViewPosition;
struct ToonMaterial {
	vec3 diffuseColor;
};
void RE_Direct_Toon( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in ToonMaterial material, inout ReflectedLight reflectedLight ) {
	vec3 irradiance = getGradientIrradiance( geometryNormal, directLight.direction ) * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Toon( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in ToonMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Toon
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Toon`,Wy=`BlinnPhongMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.specularColor = specular;
material.specularShininess = shininess;
material.specularStrength = specularStrength;`,Xy=`varying vec3 vViewPosition;
struct BlinnPhongMaterial {
	vec3 diffuseColor;
	vec3 specularColor;
	float specularShininess;
	float specularStrength;
};
void RE_Direct_BlinnPhong( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in BlinnPhongMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
	reflectedLight.directSpecular += irradiance * BRDF_BlinnPhong( directLight.direction, geometryViewDir, geometryNormal, material.specularColor, material.specularShininess ) * material.specularStrength;
}
void RE_IndirectDiffuse_BlinnPhong( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in BlinnPhongMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_BlinnPhong
#define RE_IndirectDiffuse		RE_IndirectDiffuse_BlinnPhong`,qy=`PhysicalMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.diffuseContribution = diffuseColor.rgb * ( 1.0 - metalnessFactor );
material.metalness = metalnessFactor;
vec3 dxy = max( abs( dFdx( nonPerturbedNormal ) ), abs( dFdy( nonPerturbedNormal ) ) );
float geometryRoughness = max( max( dxy.x, dxy.y ), dxy.z );
material.roughness = max( roughnessFactor, 0.045 );
material.roughness += geometryRoughness;
material.roughness = min( material.roughness, 1.0 );
#ifdef USE_DIFFUSE_ROUGHNESS
	float diffuseRoughnessFactor = diffuseRoughness;
	#ifdef USE_DIFFUSE_ROUGHNESSMAP
		diffuseRoughnessFactor *= texture2D( diffuseRoughnessMap, vDiffuseRoughnessMapUv ).r;
	#endif
	material.diffuseRoughness = saturate( diffuseRoughnessFactor );
#endif
#ifdef IOR
	material.ior = ior;
	#ifdef USE_SPECULAR
		float specularIntensityFactor = specularIntensity;
		vec3 specularColorFactor = specularColor;
		#ifdef USE_SPECULAR_COLORMAP
			specularColorFactor *= texture2D( specularColorMap, vSpecularColorMapUv ).rgb;
		#endif
		#ifdef USE_SPECULAR_INTENSITYMAP
			specularIntensityFactor *= texture2D( specularIntensityMap, vSpecularIntensityMapUv ).a;
		#endif
		material.specularF90 = mix( specularIntensityFactor, 1.0, metalnessFactor );
	#else
		float specularIntensityFactor = 1.0;
		vec3 specularColorFactor = vec3( 1.0 );
		material.specularF90 = 1.0;
	#endif
	material.specularColor = min( pow2( ( material.ior - 1.0 ) / ( material.ior + 1.0 ) ) * specularColorFactor, vec3( 1.0 ) ) * specularIntensityFactor;
	material.specularColorBlended = mix( material.specularColor, diffuseColor.rgb, metalnessFactor );
#else
	material.specularColor = vec3( 0.04 );
	material.specularColorBlended = mix( material.specularColor, diffuseColor.rgb, metalnessFactor );
	material.specularF90 = 1.0;
#endif
#ifdef USE_CLEARCOAT
	material.clearcoat = clearcoat;
	material.clearcoatRoughness = clearcoatRoughness;
	material.clearcoatF0 = vec3( 0.04 );
	material.clearcoatF90 = 1.0;
	#ifdef USE_CLEARCOATMAP
		material.clearcoat *= texture2D( clearcoatMap, vClearcoatMapUv ).x;
	#endif
	#ifdef USE_CLEARCOAT_ROUGHNESSMAP
		material.clearcoatRoughness *= texture2D( clearcoatRoughnessMap, vClearcoatRoughnessMapUv ).y;
	#endif
	material.clearcoat = saturate( material.clearcoat );	material.clearcoatRoughness = max( material.clearcoatRoughness, 0.045 );
	material.clearcoatRoughness += geometryRoughness;
	material.clearcoatRoughness = min( material.clearcoatRoughness, 1.0 );
#endif
#ifdef USE_DISPERSION
	material.dispersion = dispersion;
#endif
#ifdef USE_RETROREFLECTION
	material.retroreflectivity = retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
	material.iridescence = iridescence;
	material.iridescenceIOR = iridescenceIOR;
	#ifdef USE_IRIDESCENCEMAP
		material.iridescence *= texture2D( iridescenceMap, vIridescenceMapUv ).r;
	#endif
	#ifdef USE_IRIDESCENCE_THICKNESSMAP
		material.iridescenceThickness = (iridescenceThicknessMaximum - iridescenceThicknessMinimum) * texture2D( iridescenceThicknessMap, vIridescenceThicknessMapUv ).g + iridescenceThicknessMinimum;
	#else
		material.iridescenceThickness = iridescenceThicknessMaximum;
	#endif
#endif
#ifdef USE_SHEEN
	material.sheenColor = sheenColor;
	#ifdef USE_SHEEN_COLORMAP
		material.sheenColor *= texture2D( sheenColorMap, vSheenColorMapUv ).rgb;
	#endif
	material.sheenRoughness = clamp( sheenRoughness, 0.0001, 1.0 );
	#ifdef USE_SHEEN_ROUGHNESSMAP
		material.sheenRoughness *= texture2D( sheenRoughnessMap, vSheenRoughnessMapUv ).a;
	#endif
#endif
#ifdef USE_ANISOTROPY
	#ifdef USE_ANISOTROPYMAP
		mat2 anisotropyMat = mat2( anisotropyVector.x, anisotropyVector.y, - anisotropyVector.y, anisotropyVector.x );
		vec3 anisotropyPolar = texture2D( anisotropyMap, vAnisotropyMapUv ).rgb;
		vec2 anisotropyV = anisotropyMat * normalize( 2.0 * anisotropyPolar.rg - vec2( 1.0 ) ) * anisotropyPolar.b;
	#else
		vec2 anisotropyV = anisotropyVector;
	#endif
	material.anisotropy = length( anisotropyV );
	if( material.anisotropy == 0.0 ) {
		anisotropyV = vec2( 1.0, 0.0 );
	} else {
		anisotropyV /= material.anisotropy;
		material.anisotropy = saturate( material.anisotropy );
	}
	material.alphaT = mix( pow2( material.roughness ), 1.0, pow2( material.anisotropy ) );
	material.anisotropyT = tbn[ 0 ] * anisotropyV.x + tbn[ 1 ] * anisotropyV.y;
	material.anisotropyB = tbn[ 1 ] * anisotropyV.x - tbn[ 0 ] * anisotropyV.y;
#endif`,Yy=`uniform sampler2D dfgLUT;
struct PhysicalMaterial {
	vec3 diffuseColor;
	vec3 diffuseContribution;
	vec3 specularColor;
	vec3 specularColorBlended;
	float roughness;
	float metalness;
	float specularF90;
	float dispersion;
	vec2 dfg;
	vec3 multiScatteringCompensation;
	#ifdef USE_DIFFUSE_ROUGHNESS
		float diffuseRoughness;
	#endif
	#ifdef USE_RETROREFLECTION
		float retroreflectivity;
	#endif
	#ifdef USE_CLEARCOAT
		float clearcoat;
		float clearcoatRoughness;
		vec3 clearcoatF0;
		float clearcoatF90;
	#endif
	#ifdef USE_IRIDESCENCE
		float iridescence;
		float iridescenceIOR;
		float iridescenceThickness;
		vec3 iridescenceFresnel;
		vec3 iridescenceF0Dielectric;
		vec3 iridescenceF0Metallic;
	#endif
	#ifdef USE_SHEEN
		vec3 sheenColor;
		float sheenRoughness;
	#endif
	#ifdef IOR
		float ior;
	#endif
	#ifdef USE_TRANSMISSION
		float transmission;
		float transmissionAlpha;
		float thickness;
		float attenuationDistance;
		vec3 attenuationColor;
	#endif
	#ifdef USE_ANISOTROPY
		float anisotropy;
		float alphaT;
		vec3 anisotropyT;
		vec3 anisotropyB;
	#endif
};
vec3 clearcoatSpecularDirect = vec3( 0.0 );
vec3 clearcoatSpecularIndirect = vec3( 0.0 );
vec3 sheenSpecularDirect = vec3( 0.0 );
vec3 sheenSpecularIndirect = vec3(0.0 );
vec3 Schlick_to_F0( const in vec3 f, const in float f90, const in float dotVH ) {
    float x = clamp( 1.0 - dotVH, 0.0, 1.0 );
    float x2 = x * x;
    float x5 = clamp( x * x2 * x2, 0.0, 0.9999 );
    return ( f - vec3( f90 ) * x5 ) / ( 1.0 - x5 );
}
#ifdef USE_DIFFUSE_ROUGHNESS
	const float EON_EPSILON = 1e-7;
	float FON_DirectionalAlbedo( const in float mu, const in float roughness, const in float A ) {
		float muComp = 1.0 - mu;
		float gOverPi = muComp * ( 0.0571085289 + muComp * ( 0.491881867 + muComp * ( - 0.332181442 + muComp * 0.0714429953 ) ) );
		return A * ( 1.0 + roughness * gOverPi );
	}
	vec3 BRDF_EON( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in vec3 diffuseColor, const in float roughness ) {
		vec3 rho = saturate( diffuseColor );
		if ( roughness <= EON_EPSILON ) return BRDF_Lambert( rho );
		float dotNL = saturate( dot( normal, lightDir ) );
		float dotNV = saturate( dot( normal, viewDir ) );
		float s = dot( lightDir, viewDir ) - dotNL * dotNV;
		float sOverT = ( s > 0.0 ) ? s / max( max( dotNL, dotNV ), EON_EPSILON ) : s;
		float A = 1.0 / ( 1.0 + ( 0.5 - 2.0 / ( 3.0 * PI ) ) * roughness );
		vec3 singleScatter = rho * RECIPROCAL_PI * A * ( 1.0 + roughness * sOverT );
		float averageAlbedo = A * ( 1.0 + ( 2.0 / 3.0 - 28.0 / ( 15.0 * PI ) ) * roughness );
		float albedoV = FON_DirectionalAlbedo( dotNV, roughness, A );
		float albedoL = FON_DirectionalAlbedo( dotNL, roughness, A );
		vec3 rhoMultiScatter = rho * rho * averageAlbedo / max( vec3( EON_EPSILON ), vec3( 1.0 ) - rho * ( 1.0 - averageAlbedo ) );
		vec3 multiScatter = rhoMultiScatter * RECIPROCAL_PI
			* max( EON_EPSILON, 1.0 - albedoV )
			* max( EON_EPSILON, 1.0 - albedoL )
			/ max( EON_EPSILON, 1.0 - averageAlbedo );
		return singleScatter + multiScatter;
	}
	vec3 EON_DirectionalAlbedo( const in vec3 diffuseColor, const in float roughness, const in float dotNV ) {
		vec3 rho = saturate( diffuseColor );
		if ( roughness <= EON_EPSILON ) return rho;
		float A = 1.0 / ( 1.0 + ( 0.5 - 2.0 / ( 3.0 * PI ) ) * roughness );
		float directionalAlbedo = FON_DirectionalAlbedo( dotNV, roughness, A );
		float averageAlbedo = A * ( 1.0 + ( 2.0 / 3.0 - 28.0 / ( 15.0 * PI ) ) * roughness );
		vec3 rhoMultiScatter = rho * rho * averageAlbedo / max( vec3( EON_EPSILON ), vec3( 1.0 ) - rho * ( 1.0 - averageAlbedo ) );
		return rho * directionalAlbedo + rhoMultiScatter * ( 1.0 - directionalAlbedo );
	}
#endif
float V_GGX_SmithCorrelated( const in float alpha, const in float dotNL, const in float dotNV ) {
	float a2 = pow2( alpha );
	float gv = dotNL * sqrt( a2 + ( 1.0 - a2 ) * pow2( dotNV ) );
	float gl = dotNV * sqrt( a2 + ( 1.0 - a2 ) * pow2( dotNL ) );
	return 0.5 / max( gv + gl, EPSILON );
}
float D_GGX( const in float alpha, const in float dotNH ) {
	float a2 = pow2( alpha );
	float denom = pow2( dotNH ) * ( a2 - 1.0 ) + 1.0;
	return RECIPROCAL_PI * a2 / pow2( denom );
}
#ifdef USE_ANISOTROPY
	float V_GGX_SmithCorrelated_Anisotropic( const in float alphaT, const in float alphaB, const in float dotTV, const in float dotBV, const in float dotTL, const in float dotBL, const in float dotNV, const in float dotNL ) {
		float gv = dotNL * length( vec3( alphaT * dotTV, alphaB * dotBV, dotNV ) );
		float gl = dotNV * length( vec3( alphaT * dotTL, alphaB * dotBL, dotNL ) );
		return 0.5 / max( gv + gl, EPSILON );
	}
	float D_GGX_Anisotropic( const in float alphaT, const in float alphaB, const in float dotNH, const in float dotTH, const in float dotBH ) {
		float a2 = alphaT * alphaB;
		highp vec3 v = vec3( alphaB * dotTH, alphaT * dotBH, a2 * dotNH );
		highp float v2 = dot( v, v );
		float w2 = a2 / v2;
		return RECIPROCAL_PI * a2 * pow2 ( w2 );
	}
#endif
#ifdef USE_CLEARCOAT
	vec3 BRDF_GGX_Clearcoat( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in PhysicalMaterial material) {
		vec3 f0 = material.clearcoatF0;
		float f90 = material.clearcoatF90;
		float roughness = max( material.clearcoatRoughness, 0.045 );
		float alpha = pow2( roughness );
		vec3 halfDir = normalize( lightDir + viewDir );
		float dotNL = saturate( dot( normal, lightDir ) );
		float dotNV = saturate( dot( normal, viewDir ) );
		float dotNH = saturate( dot( normal, halfDir ) );
		float dotVH = saturate( dot( viewDir, halfDir ) );
		vec3 F = F_Schlick( f0, f90, dotVH );
		float V = V_GGX_SmithCorrelated( alpha, dotNL, dotNV );
		float D = D_GGX( alpha, dotNH );
		return F * ( V * D );
	}
#endif
vec3 BRDF_GGX( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in PhysicalMaterial material ) {
	vec3 f0 = material.specularColorBlended;
	float f90 = material.specularF90;
	float roughness = max( material.roughness, 0.045 );
	float alpha = pow2( roughness );
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNL = saturate( dot( normal, lightDir ) );
	float dotNV = saturate( dot( normal, viewDir ) );
	float dotNH = saturate( dot( normal, halfDir ) );
	float dotVH = saturate( dot( viewDir, halfDir ) );
	vec3 F = F_Schlick( f0, f90, dotVH );
	#ifdef USE_IRIDESCENCE
		F = mix( F, material.iridescenceFresnel, material.iridescence );
	#endif
	#ifdef USE_ANISOTROPY
		float dotTL = dot( material.anisotropyT, lightDir );
		float dotTV = dot( material.anisotropyT, viewDir );
		float dotTH = dot( material.anisotropyT, halfDir );
		float dotBL = dot( material.anisotropyB, lightDir );
		float dotBV = dot( material.anisotropyB, viewDir );
		float dotBH = dot( material.anisotropyB, halfDir );
		float alphaT = max( material.alphaT, alpha );
		float V = V_GGX_SmithCorrelated_Anisotropic( alphaT, alpha, dotTV, dotBV, dotTL, dotBL, dotNV, dotNL );
		float D = D_GGX_Anisotropic( alphaT, alpha, dotNH, dotTH, dotBH );
	#else
		float V = V_GGX_SmithCorrelated( alpha, dotNL, dotNV );
		float D = D_GGX( alpha, dotNH );
	#endif
	return F * ( V * D );
}
vec2 LTC_Uv( const in vec3 N, const in vec3 V, const in float roughness ) {
	const float LUT_SIZE = 64.0;
	const float LUT_SCALE = ( LUT_SIZE - 1.0 ) / LUT_SIZE;
	const float LUT_BIAS = 0.5 / LUT_SIZE;
	float dotNV = saturate( dot( N, V ) );
	vec2 uv = vec2( roughness, sqrt( 1.0 - dotNV ) );
	uv = uv * LUT_SCALE + LUT_BIAS;
	return uv;
}
float LTC_ClippedSphereFormFactor( const in vec3 f ) {
	float l = length( f );
	return max( ( l * l + f.z ) / ( l + 1.0 ), 0.0 );
}
vec3 LTC_EdgeVectorFormFactor( const in vec3 v1, const in vec3 v2 ) {
	float x = dot( v1, v2 );
	float y = abs( x );
	float a = 0.8543985 + ( 0.4965155 + 0.0145206 * y ) * y;
	float b = 3.4175940 + ( 4.1616724 + y ) * y;
	float v = a / b;
	float theta_sintheta = ( x > 0.0 ) ? v : 0.5 * inversesqrt( max( 1.0 - x * x, 1e-7 ) ) - v;
	return cross( v1, v2 ) * theta_sintheta;
}
vec3 LTC_Evaluate( const in vec3 N, const in vec3 V, const in vec3 P, const in mat3 mInv, const in vec3 rectCoords[ 4 ] ) {
	vec3 v1 = rectCoords[ 1 ] - rectCoords[ 0 ];
	vec3 v2 = rectCoords[ 3 ] - rectCoords[ 0 ];
	vec3 lightNormal = cross( v1, v2 );
	if( dot( lightNormal, P - rectCoords[ 0 ] ) < 0.0 ) return vec3( 0.0 );
	vec3 T1, T2;
	T1 = normalize( V - N * dot( V, N ) );
	T2 = - cross( N, T1 );
	mat3 mat = mInv * transpose( mat3( T1, T2, N ) );
	vec3 coords[ 4 ];
	coords[ 0 ] = mat * ( rectCoords[ 0 ] - P );
	coords[ 1 ] = mat * ( rectCoords[ 1 ] - P );
	coords[ 2 ] = mat * ( rectCoords[ 2 ] - P );
	coords[ 3 ] = mat * ( rectCoords[ 3 ] - P );
	coords[ 0 ] = normalize( coords[ 0 ] );
	coords[ 1 ] = normalize( coords[ 1 ] );
	coords[ 2 ] = normalize( coords[ 2 ] );
	coords[ 3 ] = normalize( coords[ 3 ] );
	vec3 vectorFormFactor = vec3( 0.0 );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 0 ], coords[ 1 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 1 ], coords[ 2 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 2 ], coords[ 3 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 3 ], coords[ 0 ] );
	float result = LTC_ClippedSphereFormFactor( vectorFormFactor );
	return vec3( result );
}
#if defined( USE_SHEEN )
float D_Charlie( float roughness, float dotNH ) {
	float alpha = pow2( roughness );
	float invAlpha = 1.0 / alpha;
	float cos2h = dotNH * dotNH;
	float sin2h = max( 1.0 - cos2h, 0.0078125 );
	return ( 2.0 + invAlpha ) * pow( sin2h, invAlpha * 0.5 ) / ( 2.0 * PI );
}
float V_Neubelt( float dotNV, float dotNL ) {
	return saturate( 1.0 / ( 4.0 * ( dotNL + dotNV - dotNL * dotNV ) ) );
}
vec3 BRDF_Sheen( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, vec3 sheenColor, const in float sheenRoughness ) {
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNL = saturate( dot( normal, lightDir ) );
	float dotNV = saturate( dot( normal, viewDir ) );
	float dotNH = saturate( dot( normal, halfDir ) );
	float D = D_Charlie( sheenRoughness, dotNH );
	float V = V_Neubelt( dotNV, dotNL );
	return sheenColor * ( D * V );
}
#endif
float IBLSheenBRDF( const in vec3 normal, const in vec3 viewDir, const in float roughness ) {
	float dotNV = saturate( dot( normal, viewDir ) );
	float r2 = roughness * roughness;
	float rInv = 1.0 / ( roughness + 0.1 );
	float a = -1.9362 + 1.0678 * roughness + 0.4573 * r2 - 0.8469 * rInv;
	float b = -0.6014 + 0.5538 * roughness - 0.4670 * r2 - 0.1255 * rInv;
	float DG = exp( a * dotNV + b );
	return saturate( DG );
}
vec3 EnvironmentBRDF( const in vec3 normal, const in vec3 viewDir, const in vec3 specularColor, const in float specularF90, const in float roughness ) {
	float dotNV = saturate( dot( normal, viewDir ) );
	vec2 fab = texture2D( dfgLUT, vec2( roughness, dotNV ) ).rg;
	return specularColor * fab.x + specularF90 * fab.y;
}
#ifdef USE_IRIDESCENCE
void computeMultiscatteringIridescence( const in vec2 fab, const in vec3 specularColor, const in float specularF90, const in float iridescence, const in vec3 iridescenceF0, inout vec3 singleScatter, inout vec3 multiScatter ) {
#else
void computeMultiscattering( const in vec2 fab, const in vec3 specularColor, const in float specularF90, inout vec3 singleScatter, inout vec3 multiScatter ) {
#endif
	#ifdef USE_IRIDESCENCE
		vec3 Fr = mix( specularColor, iridescenceF0, iridescence );
	#else
		vec3 Fr = specularColor;
	#endif
	vec3 FssEss = Fr * fab.x + specularF90 * fab.y;
	float Ess = fab.x + fab.y;
	float Ems = 1.0 - Ess;
	vec3 Favg = Fr + ( 1.0 - Fr ) * 0.047619;	vec3 Fms = FssEss * Favg / ( 1.0 - Ems * Favg );
	singleScatter += FssEss;
	multiScatter += Fms * Ems;
}
#if NUM_RECT_AREA_LIGHTS > 0
	void RE_Direct_RectArea_Physical( const in RectAreaLight rectAreaLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
		vec3 normal = geometryNormal;
		vec3 viewDir = geometryViewDir;
		vec3 position = geometryPosition;
		vec3 lightPos = rectAreaLight.position;
		vec3 halfWidth = rectAreaLight.halfWidth;
		vec3 halfHeight = rectAreaLight.halfHeight;
		vec3 lightColor = rectAreaLight.color;
		float roughness = material.roughness;
		vec3 rectCoords[ 4 ];
		rectCoords[ 0 ] = lightPos + halfWidth - halfHeight;		rectCoords[ 1 ] = lightPos - halfWidth - halfHeight;
		rectCoords[ 2 ] = lightPos - halfWidth + halfHeight;
		rectCoords[ 3 ] = lightPos + halfWidth + halfHeight;
		vec2 uv = LTC_Uv( normal, viewDir, roughness );
		vec4 t1 = texture2D( ltc_1, uv );
		vec4 t2 = texture2D( ltc_2, uv );
		mat3 mInv = mat3(
			vec3( t1.x, 0, t1.y ),
			vec3(    0, 1,    0 ),
			vec3( t1.z, 0, t1.w )
		);
		vec3 fresnel = ( material.specularColorBlended * t2.x + ( material.specularF90 - material.specularColorBlended ) * t2.y );
		reflectedLight.directSpecular += lightColor * fresnel * LTC_Evaluate( normal, viewDir, position, mInv, rectCoords );
		reflectedLight.directDiffuse += lightColor * material.diffuseContribution * LTC_Evaluate( normal, viewDir, position, mat3( 1.0 ), rectCoords );
		#ifdef USE_CLEARCOAT
			vec3 Ncc = geometryClearcoatNormal;
			vec2 uvClearcoat = LTC_Uv( Ncc, viewDir, material.clearcoatRoughness );
			vec4 t1Clearcoat = texture2D( ltc_1, uvClearcoat );
			vec4 t2Clearcoat = texture2D( ltc_2, uvClearcoat );
			mat3 mInvClearcoat = mat3(
				vec3( t1Clearcoat.x, 0, t1Clearcoat.y ),
				vec3(             0, 1,             0 ),
				vec3( t1Clearcoat.z, 0, t1Clearcoat.w )
			);
			vec3 fresnelClearcoat = material.clearcoatF0 * t2Clearcoat.x + ( material.clearcoatF90 - material.clearcoatF0 ) * t2Clearcoat.y;
			clearcoatSpecularDirect += lightColor * fresnelClearcoat * LTC_Evaluate( Ncc, viewDir, position, mInvClearcoat, rectCoords );
		#endif
	}
#endif
void RE_Direct_Physical( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	#ifdef USE_CLEARCOAT
		float dotNLcc = saturate( dot( geometryClearcoatNormal, directLight.direction ) );
		vec3 ccIrradiance = dotNLcc * directLight.color;
		clearcoatSpecularDirect += ccIrradiance * BRDF_GGX_Clearcoat( directLight.direction, geometryViewDir, geometryClearcoatNormal, material );
	#endif
	#ifdef USE_SHEEN
 
 		sheenSpecularDirect += irradiance * BRDF_Sheen( directLight.direction, geometryViewDir, geometryNormal, material.sheenColor, material.sheenRoughness );
 
 		float sheenAlbedoV = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
 		float sheenAlbedoL = IBLSheenBRDF( geometryNormal, directLight.direction, material.sheenRoughness );
 
 		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * max( sheenAlbedoV, sheenAlbedoL );
 
 		irradiance *= sheenEnergyComp;
 
 	#endif
	vec3 specularBRDF = BRDF_GGX( directLight.direction, geometryViewDir, geometryNormal, material );
	#ifdef USE_RETROREFLECTION
		vec3 retroViewDir = reflect( - geometryViewDir, geometryNormal );
		vec3 retroSpecularBRDF = BRDF_GGX( directLight.direction, retroViewDir, geometryNormal, material );
		specularBRDF = mix( specularBRDF, retroSpecularBRDF, saturate( material.retroreflectivity ) );
	#endif
	reflectedLight.directSpecular += irradiance * specularBRDF * material.multiScatteringCompensation;
	vec3 halfDir = normalize( directLight.direction + geometryViewDir );
	float dotVH = saturate( dot( geometryViewDir, halfDir ) );
	vec3 F = F_Schlick( material.specularColor, material.specularF90, dotVH );
	#ifdef USE_RETROREFLECTION
		vec3 retroHalfDir = normalize( directLight.direction + retroViewDir );
		float dotRetroVH = saturate( dot( retroViewDir, retroHalfDir ) );
		vec3 retroF = F_Schlick( material.specularColor, material.specularF90, dotRetroVH );
		F = mix( F, retroF, saturate( material.retroreflectivity ) );
	#endif
	#ifdef USE_DIFFUSE_ROUGHNESS
		vec3 diffuseBRDF = BRDF_EON( directLight.direction, geometryViewDir, geometryNormal, material.diffuseColor, material.diffuseRoughness ) * ( 1.0 - material.metalness );
	#else
		vec3 diffuseBRDF = BRDF_Lambert( material.diffuseContribution );
	#endif
	reflectedLight.directDiffuse += irradiance * diffuseBRDF * ( 1.0 - F );
}
void RE_IndirectDiffuse_Physical( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
	vec3 singleScattering = vec3( 0.0 );
	vec3 multiScattering = vec3( 0.0 );
	#ifdef USE_IRIDESCENCE
		computeMultiscatteringIridescence( material.dfg, material.specularColor, material.specularF90, material.iridescence, material.iridescenceF0Dielectric, singleScattering, multiScattering );
	#else
		computeMultiscattering( material.dfg, material.specularColor, material.specularF90, singleScattering, multiScattering );
	#endif
	#ifdef USE_DIFFUSE_ROUGHNESS
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		vec3 diffuseAlbedo = EON_DirectionalAlbedo( material.diffuseColor, material.diffuseRoughness, dotNV ) * ( 1.0 - material.metalness );
		vec3 diffuse = irradiance * RECIPROCAL_PI * diffuseAlbedo * ( 1.0 - singleScattering - multiScattering );
	#else
		vec3 diffuse = irradiance * BRDF_Lambert( material.diffuseContribution ) * ( 1.0 - singleScattering - multiScattering );
	#endif
	#ifdef USE_SHEEN
		float sheenAlbedo = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
		sheenSpecularIndirect += irradiance * material.sheenColor * sheenAlbedo * RECIPROCAL_PI;
		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * sheenAlbedo;
		diffuse *= sheenEnergyComp;
	#endif
	reflectedLight.indirectDiffuse += diffuse;
}
void RE_IndirectSpecular_Physical( const in vec3 radiance, const in vec3 irradiance, const in vec3 clearcoatRadiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight) {
	#ifdef USE_CLEARCOAT
		clearcoatSpecularIndirect += clearcoatRadiance * EnvironmentBRDF( geometryClearcoatNormal, geometryViewDir, material.clearcoatF0, material.clearcoatF90, material.clearcoatRoughness );
	#endif
	#ifdef USE_SHEEN
		sheenSpecularIndirect += irradiance * material.sheenColor * IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness ) * RECIPROCAL_PI;
 	#endif
	vec3 singleScatteringDielectric = vec3( 0.0 );
	vec3 multiScatteringDielectric = vec3( 0.0 );
	vec3 singleScatteringMetallic = vec3( 0.0 );
	vec3 multiScatteringMetallic = vec3( 0.0 );
	#ifdef USE_IRIDESCENCE
		computeMultiscatteringIridescence( material.dfg, material.specularColor, material.specularF90, material.iridescence, material.iridescenceF0Dielectric, singleScatteringDielectric, multiScatteringDielectric );
		computeMultiscatteringIridescence( material.dfg, material.diffuseColor, material.specularF90, material.iridescence, material.iridescenceF0Metallic, singleScatteringMetallic, multiScatteringMetallic );
	#else
		computeMultiscattering( material.dfg, material.specularColor, material.specularF90, singleScatteringDielectric, multiScatteringDielectric );
		computeMultiscattering( material.dfg, material.diffuseColor, material.specularF90, singleScatteringMetallic, multiScatteringMetallic );
	#endif
	vec3 singleScattering = mix( singleScatteringDielectric, singleScatteringMetallic, material.metalness );
	vec3 multiScattering = mix( multiScatteringDielectric, multiScatteringMetallic, material.metalness );
	vec3 totalScatteringDielectric = singleScatteringDielectric + multiScatteringDielectric;
	#ifdef USE_DIFFUSE_ROUGHNESS
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		vec3 diffuse = EON_DirectionalAlbedo( material.diffuseColor, material.diffuseRoughness, dotNV ) * ( 1.0 - material.metalness ) * ( 1.0 - totalScatteringDielectric );
	#else
		vec3 diffuse = material.diffuseContribution * ( 1.0 - totalScatteringDielectric );
	#endif
	vec3 cosineWeightedIrradiance = irradiance * RECIPROCAL_PI;
	vec3 indirectSpecular = radiance * singleScattering;
	indirectSpecular += multiScattering * cosineWeightedIrradiance;
	vec3 indirectDiffuse = diffuse * cosineWeightedIrradiance;
	#ifdef USE_SHEEN
		float sheenAlbedo = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * sheenAlbedo;
		indirectSpecular *= sheenEnergyComp;
		indirectDiffuse *= sheenEnergyComp;
	#endif
	reflectedLight.indirectSpecular += indirectSpecular;
	reflectedLight.indirectDiffuse += indirectDiffuse;
}
#define RE_Direct				RE_Direct_Physical
#define RE_Direct_RectArea		RE_Direct_RectArea_Physical
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Physical
#define RE_IndirectSpecular		RE_IndirectSpecular_Physical
float computeSpecularOcclusion( const in float dotNV, const in float ambientOcclusion, const in float roughness ) {
	return saturate( pow( dotNV + ambientOcclusion, exp2( - 16.0 * roughness - 1.0 ) ) - 1.0 + ambientOcclusion );
}`,$y=`
vec3 geometryPosition = - vViewPosition;
vec3 geometryNormal = normal;
vec3 geometryViewDir = ( isOrthographic ) ? vec3( 0, 0, 1 ) : normalize( vViewPosition );
vec3 geometryClearcoatNormal = vec3( 0.0 );
#ifdef USE_CLEARCOAT
	geometryClearcoatNormal = clearcoatNormal;
#endif
#ifdef USE_IRIDESCENCE
	float dotNVi = saturate( dot( normal, geometryViewDir ) );
	if ( material.iridescenceThickness == 0.0 ) {
		material.iridescence = 0.0;
	} else {
		material.iridescence = saturate( material.iridescence );
	}
	if ( material.iridescence > 0.0 ) {
		vec3 iridescenceFresnelDielectric = evalIridescence( 1.0, material.iridescenceIOR, dotNVi, material.iridescenceThickness, material.specularColor );
		vec3 iridescenceFresnelMetallic = evalIridescence( 1.0, material.iridescenceIOR, dotNVi, material.iridescenceThickness, material.diffuseColor );
		material.iridescenceFresnel = mix( iridescenceFresnelDielectric, iridescenceFresnelMetallic, material.metalness );
		material.iridescenceF0Dielectric = Schlick_to_F0( iridescenceFresnelDielectric, 1.0, dotNVi );
		material.iridescenceF0Metallic = Schlick_to_F0( iridescenceFresnelMetallic, 1.0, dotNVi );
	}
#endif
#ifdef STANDARD
	float dotNVms = saturate( dot( geometryNormal, geometryViewDir ) );
	material.dfg = texture2D( dfgLUT, vec2( material.roughness, dotNVms ) ).rg;
	#if ( NUM_SUN_LIGHTS > 0 || NUM_DIR_LIGHTS > 0 || NUM_POINT_LIGHTS > 0 || NUM_SPOT_LIGHTS > 0 )
		float EssMs = material.dfg.x + material.dfg.y;
		material.multiScatteringCompensation = 1.0 + material.specularColorBlended * ( 1.0 / EssMs - 1.0 );
	#endif
#endif
IncidentLight directLight;
#if ( NUM_POINT_LIGHTS > 0 ) && defined( RE_Direct )
	PointLight pointLight;
	#if defined( USE_SHADOWMAP ) && NUM_POINT_LIGHT_SHADOWS > 0
	PointLightShadow pointLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_POINT_LIGHTS; i ++ ) {
		pointLight = pointLights[ i ];
		getPointLightInfo( pointLight, geometryPosition, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_POINT_LIGHT_SHADOWS ) && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
		pointLightShadow = pointLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getPointShadow( pointShadowMap[ i ], pointLightShadow.shadowMapSize, pointLightShadow.shadowIntensity, pointLightShadow.shadowBias, pointLightShadow.shadowRadius, vPointShadowCoord[ i ], pointLightShadow.shadowCameraNear, pointLightShadow.shadowCameraFar ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_SPOT_LIGHTS > 0 ) && defined( RE_Direct )
	SpotLight spotLight;
	vec4 spotColor;
	vec3 spotLightCoord;
	bool inSpotLightMap;
	#if defined( USE_SHADOWMAP ) && NUM_SPOT_LIGHT_SHADOWS > 0
	SpotLightShadow spotLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHTS; i ++ ) {
		spotLight = spotLights[ i ];
		getSpotLightInfo( spotLight, geometryPosition, directLight );
		#if ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
		#define SPOT_LIGHT_MAP_INDEX UNROLLED_LOOP_INDEX
		#elif ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
		#define SPOT_LIGHT_MAP_INDEX NUM_SPOT_LIGHT_MAPS
		#else
		#define SPOT_LIGHT_MAP_INDEX ( UNROLLED_LOOP_INDEX - NUM_SPOT_LIGHT_SHADOWS + NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
		#endif
		#if ( SPOT_LIGHT_MAP_INDEX < NUM_SPOT_LIGHT_MAPS )
			spotLightCoord = vSpotLightCoord[ i ].xyz / vSpotLightCoord[ i ].w;
			inSpotLightMap = all( lessThan( abs( spotLightCoord * 2. - 1. ), vec3( 1.0 ) ) );
			spotColor = texture2D( spotLightMap[ SPOT_LIGHT_MAP_INDEX ], spotLightCoord.xy );
			directLight.color = inSpotLightMap ? directLight.color * spotColor.rgb : directLight.color;
		#endif
		#undef SPOT_LIGHT_MAP_INDEX
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
		spotLightShadow = spotLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getShadow( spotShadowMap[ i ], spotLightShadow.shadowMapSize, spotLightShadow.shadowIntensity, spotLightShadow.shadowBias, spotLightShadow.shadowRadius, vSpotLightCoord[ i ] ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_SUN_LIGHTS > 0 ) && defined( RE_Direct )
	SunLight sunLight;
	#if defined( USE_SHADOWMAP ) && NUM_SUN_LIGHT_SHADOWS > 0
	SunLightShadow sunLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SUN_LIGHTS; i ++ ) {
		sunLight = sunLights[ i ];
		getSunLightInfo( sunLight, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SUN_LIGHT_SHADOWS )
		sunLightShadow = sunLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getSunShadow( sunShadowMap[ i ], sunLightShadow, UNROLLED_LOOP_INDEX ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_DIR_LIGHTS > 0 ) && defined( RE_Direct )
	DirectionalLight directionalLight;
	#if defined( USE_SHADOWMAP ) && NUM_DIR_LIGHT_SHADOWS > 0
	DirectionalLightShadow directionalLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_DIR_LIGHTS; i ++ ) {
		directionalLight = directionalLights[ i ];
		getDirectionalLightInfo( directionalLight, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_DIR_LIGHT_SHADOWS )
		directionalLightShadow = directionalLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getShadow( directionalShadowMap[ i ], directionalLightShadow.shadowMapSize, directionalLightShadow.shadowIntensity, directionalLightShadow.shadowBias, directionalLightShadow.shadowRadius, vDirectionalShadowCoord[ i ] ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_RECT_AREA_LIGHTS > 0 ) && defined( RE_Direct_RectArea )
	RectAreaLight rectAreaLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_RECT_AREA_LIGHTS; i ++ ) {
		rectAreaLight = rectAreaLights[ i ];
		RE_Direct_RectArea( rectAreaLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if defined( RE_IndirectDiffuse )
	vec3 iblIrradiance = vec3( 0.0 );
	vec3 irradiance = getAmbientLightIrradiance( ambientLightColor );
	#if defined( USE_LIGHT_PROBES )
		irradiance += getLightProbeIrradiance( lightProbe, geometryNormal );
	#endif
	#if ( NUM_HEMI_LIGHTS > 0 )
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_HEMI_LIGHTS; i ++ ) {
			irradiance += getHemisphereLightIrradiance( hemisphereLights[ i ], geometryNormal );
		}
		#pragma unroll_loop_end
	#endif
	#if NUM_LIGHT_PROBE_GRIDS > 0
		vec3 probeWorldPos = ( ( vec4( geometryPosition, 1.0 ) - viewMatrix[ 3 ] ) * viewMatrix ).xyz;
		vec3 probeWorldNormal = transformNormalByInverseViewMatrix( geometryNormal, viewMatrix );
		int probeGrid = - 1;
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_LIGHT_PROBE_GRIDS; i ++ ) {
			if ( isInsideLightProbeGrid( probeWorldPos, probeWorldNormal, probesMin[ i ], probesMax[ i ], probesResolution[ i ] ) ) probeGrid = UNROLLED_LOOP_INDEX;
		}
		#pragma unroll_loop_end
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_LIGHT_PROBE_GRIDS; i ++ ) {
			if ( probeGrid == UNROLLED_LOOP_INDEX ) irradiance += getLightProbeGridIrradiance( probesSH[ i ], probesMin[ i ], probesMax[ i ], probesResolution[ i ], probeWorldPos, probeWorldNormal );
		}
		#pragma unroll_loop_end
	#endif
#endif
#if defined( RE_IndirectSpecular )
	vec3 radiance = vec3( 0.0 );
	vec3 clearcoatRadiance = vec3( 0.0 );
#endif`,Zy=`#if defined( RE_IndirectDiffuse )
	#ifdef USE_LIGHTMAP
		vec4 lightMapTexel = texture2D( lightMap, vLightMapUv );
		vec3 lightMapIrradiance = lightMapTexel.rgb * lightMapIntensity;
		irradiance += lightMapIrradiance;
	#endif
	#if defined( USE_ENVMAP ) && defined( ENVMAP_TYPE_PMREM )
		#if defined( STANDARD ) || defined( LAMBERT ) || defined( PHONG )
			iblIrradiance += getIBLIrradiance( geometryNormal );
		#endif
	#endif
#endif
#if defined( USE_ENVMAP ) && defined( RE_IndirectSpecular )
	#ifdef USE_ANISOTROPY
		vec3 iblRadiance = getIBLAnisotropyRadiance( geometryViewDir, geometryNormal, material.roughness, material.anisotropyB, material.anisotropy );
	#else
		vec3 iblRadiance = getIBLRadiance( geometryViewDir, geometryNormal, material.roughness );
	#endif
	#ifdef USE_RETROREFLECTION
		#ifdef USE_ANISOTROPY
			vec3 retroIBLRadiance = getIBLAnisotropyRetroRadiance( geometryViewDir, geometryNormal, material.roughness, material.anisotropyB, material.anisotropy );
		#else
			vec3 retroIBLRadiance = getIBLRetroRadiance( geometryViewDir, geometryNormal, material.roughness );
		#endif
		iblRadiance = mix( iblRadiance, retroIBLRadiance, saturate( material.retroreflectivity ) );
	#endif
	radiance += iblRadiance;
	#ifdef USE_CLEARCOAT
		clearcoatRadiance += getIBLRadiance( geometryViewDir, geometryClearcoatNormal, material.clearcoatRoughness );
	#endif
#endif`,Jy=`#if defined( RE_IndirectDiffuse )
	#if defined( LAMBERT ) || defined( PHONG )
		irradiance += iblIrradiance;
	#endif
	RE_IndirectDiffuse( irradiance, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
#endif
#if defined( RE_IndirectSpecular )
	RE_IndirectSpecular( radiance, iblIrradiance, clearcoatRadiance, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
#endif`,Ky=`#if NUM_LIGHT_PROBE_GRIDS > 0
uniform highp sampler3D probesSH[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMin[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMax[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesResolution[ NUM_LIGHT_PROBE_GRIDS ];
bool isInsideLightProbeGrid( vec3 worldPos, vec3 worldNormal, vec3 probesMin, vec3 probesMax, vec3 probesResolution ) {
	vec3 spacing = ( probesMax - probesMin ) / probesResolution;
	vec3 samplePos = worldPos + worldNormal * spacing * 0.5;
	vec3 margin = spacing * 0.01;
	return all( greaterThanEqual( samplePos, probesMin - margin ) ) && all( lessThanEqual( samplePos, probesMax + margin ) );
}
vec3 getLightProbeGridIrradiance( highp sampler3D probesSH, vec3 probesMin, vec3 probesMax, vec3 probesResolution, vec3 worldPos, vec3 worldNormal ) {
	vec3 res = probesResolution;
	vec3 gridRange = probesMax - probesMin;
	vec3 probeSpacing = gridRange / res;
	vec3 samplePos = worldPos + worldNormal * probeSpacing * 0.5;
	vec3 uvw = clamp( ( samplePos - probesMin ) / gridRange, 0.5 / res, 1.0 - 0.5 / res );
	float nz          = res.z;
	float paddedSlices = nz + 2.0;
	float atlasDepth  = 7.0 * paddedSlices;
	float uvZBase     = uvw.z * nz + 1.0;
	vec4 s0 = texture( probesSH, vec3( uvw.xy, ( uvZBase                       ) / atlasDepth ) );
	vec4 s1 = texture( probesSH, vec3( uvw.xy, ( uvZBase +       paddedSlices   ) / atlasDepth ) );
	vec4 s2 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 2.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s3 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 3.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s4 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 4.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s5 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 5.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s6 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 6.0 * paddedSlices   ) / atlasDepth ) );
	vec3 c0 = s0.xyz;
	vec3 c1 = vec3( s0.w, s1.xy );
	vec3 c2 = vec3( s1.zw, s2.x );
	vec3 c3 = s2.yzw;
	vec3 c4 = s3.xyz;
	vec3 c5 = vec3( s3.w, s4.xy );
	vec3 c6 = vec3( s4.zw, s5.x );
	vec3 c7 = s5.yzw;
	vec3 c8 = s6.xyz;
	float x = worldNormal.x, y = worldNormal.y, z = worldNormal.z;
	vec3 result = c0 * 0.886227;
	result += c1 * 2.0 * 0.511664 * y;
	result += c2 * 2.0 * 0.511664 * z;
	result += c3 * 2.0 * 0.511664 * x;
	result += c4 * 2.0 * 0.429043 * x * y;
	result += c5 * 2.0 * 0.429043 * y * z;
	result += c6 * ( 0.743125 * z * z - 0.247708 );
	result += c7 * 2.0 * 0.429043 * x * z;
	result += c8 * 0.429043 * ( x * x - y * y );
	return max( result, vec3( 0.0 ) );
}
#endif`,jy=`#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
	gl_FragDepth = vIsPerspective == 0.0 ? gl_FragCoord.z : log2( vFragDepth ) * logDepthBufFC * 0.5;
#endif`,Qy=`#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
	uniform float logDepthBufFC;
	varying float vFragDepth;
	varying float vIsPerspective;
#endif`,eb=`#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
	varying float vFragDepth;
	varying float vIsPerspective;
#endif`,tb=`#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
	vFragDepth = 1.0 + gl_Position.w;
	vIsPerspective = float( isPerspectiveMatrix( projectionMatrix ) );
#endif`,nb=`#ifdef USE_MAP
	vec4 sampledDiffuseColor = texture2D( map, vMapUv );
	#ifdef DECODE_VIDEO_TEXTURE
		sampledDiffuseColor = sRGBTransferEOTF( sampledDiffuseColor );
	#endif
	diffuseColor *= sampledDiffuseColor;
#endif`,ib=`#ifdef USE_MAP
	uniform sampler2D map;
#endif`,sb=`#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
	#if defined( USE_POINTS_UV )
		vec2 uv = vUv;
	#else
		vec2 uv = ( uvTransform * vec3( gl_PointCoord.x, 1.0 - gl_PointCoord.y, 1 ) ).xy;
	#endif
#endif
#ifdef USE_MAP
	diffuseColor *= texture2D( map, uv );
#endif
#ifdef USE_ALPHAMAP
	diffuseColor.a *= texture2D( alphaMap, uv ).g;
#endif`,rb=`#if defined( USE_POINTS_UV )
	varying vec2 vUv;
#else
	#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
		uniform mat3 uvTransform;
	#endif
#endif
#ifdef USE_MAP
	uniform sampler2D map;
#endif
#ifdef USE_ALPHAMAP
	uniform sampler2D alphaMap;
#endif`,ob=`float metalnessFactor = metalness;
#ifdef USE_METALNESSMAP
	vec4 texelMetalness = texture2D( metalnessMap, vMetalnessMapUv );
	metalnessFactor *= texelMetalness.b;
#endif`,ab=`#ifdef USE_METALNESSMAP
	uniform sampler2D metalnessMap;
#endif`,lb=`#ifdef USE_INSTANCING_MORPH
	float morphTargetInfluences[ MORPHTARGETS_COUNT ];
	float morphTargetBaseInfluence = texelFetch( morphTexture, ivec2( 0, gl_InstanceID ), 0 ).r;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		morphTargetInfluences[i] =  texelFetch( morphTexture, ivec2( i + 1, gl_InstanceID ), 0 ).r;
	}
#endif`,cb=`#if defined( USE_MORPHCOLORS )
	#if defined( USE_COLOR_ALPHA )
		vColor *= morphTargetBaseInfluence;
	#elif defined( USE_COLOR )
		vColor.rgb *= morphTargetBaseInfluence;
	#endif
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		#if defined( USE_COLOR_ALPHA )
			if ( morphTargetInfluences[ i ] != 0.0 ) vColor += getMorph( gl_VertexID, i, 2 ) * morphTargetInfluences[ i ];
		#elif defined( USE_COLOR )
			if ( morphTargetInfluences[ i ] != 0.0 ) vColor.rgb += getMorph( gl_VertexID, i, 2 ).rgb * morphTargetInfluences[ i ];
		#endif
	}
#endif`,ub=`#ifdef USE_MORPHNORMALS
	objectNormal *= morphTargetBaseInfluence;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		if ( morphTargetInfluences[ i ] != 0.0 ) objectNormal += getMorph( gl_VertexID, i, 1 ).xyz * morphTargetInfluences[ i ];
	}
#endif`,hb=`#ifdef USE_MORPHTARGETS
	#ifndef USE_INSTANCING_MORPH
		uniform float morphTargetBaseInfluence;
		uniform float morphTargetInfluences[ MORPHTARGETS_COUNT ];
	#endif
	uniform sampler2DArray morphTargetsTexture;
	uniform ivec2 morphTargetsTextureSize;
	vec4 getMorph( const in int vertexIndex, const in int morphTargetIndex, const in int offset ) {
		int texelIndex = vertexIndex * MORPHTARGETS_TEXTURE_STRIDE + offset;
		int y = texelIndex / morphTargetsTextureSize.x;
		int x = texelIndex - y * morphTargetsTextureSize.x;
		ivec3 morphUV = ivec3( x, y, morphTargetIndex );
		return texelFetch( morphTargetsTexture, morphUV, 0 );
	}
#endif`,db=`#ifdef USE_MORPHTARGETS
	transformed *= morphTargetBaseInfluence;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		if ( morphTargetInfluences[ i ] != 0.0 ) transformed += getMorph( gl_VertexID, i, 0 ).xyz * morphTargetInfluences[ i ];
	}
#endif`,fb=`float faceDirection = gl_FrontFacing ? 1.0 : - 1.0;
#ifdef FLAT_SHADED
	vec3 fdx = dFdx( vViewPosition );
	vec3 fdy = dFdy( vViewPosition );
	vec3 normal = normalize( cross( fdx, fdy ) );
#else
	vec3 normal = normalize( vNormal );
	#ifdef DOUBLE_SIDED
		normal *= faceDirection;
	#endif
#endif
#if defined( USE_NORMALMAP_TANGENTSPACE ) || defined( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY )
	#ifdef USE_TANGENT
		mat3 tbn = mat3( normalize( vTangent ), normalize( vBitangent ), normal );
	#else
		mat3 tbn = getTangentFrame( - vViewPosition, normal,
		#if defined( USE_NORMALMAP )
			vNormalMapUv
		#elif defined( USE_CLEARCOAT_NORMALMAP )
			vClearcoatNormalMapUv
		#else
			vUv
		#endif
		);
	#endif
	#ifdef DOUBLE_SIDED
		tbn[0] *= faceDirection;
		tbn[1] *= faceDirection;
	#endif
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	#ifdef USE_TANGENT
		mat3 tbn2 = mat3( normalize( vTangent ), normalize( vBitangent ), normal );
	#else
		mat3 tbn2 = getTangentFrame( - vViewPosition, normal, vClearcoatNormalMapUv );
	#endif
	#ifdef DOUBLE_SIDED
		tbn2[0] *= faceDirection;
		tbn2[1] *= faceDirection;
	#endif
#endif
vec3 nonPerturbedNormal = normal;`,pb=`#ifdef USE_NORMALMAP_OBJECTSPACE
	normal = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;
	#ifdef FLIP_SIDED
		normal = - normal;
	#endif
	#ifdef DOUBLE_SIDED
		normal = normal * faceDirection;
	#endif
	normal = normalize( normalMatrix * normal );
#elif defined( USE_NORMALMAP_TANGENTSPACE )
	vec3 mapN = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;
	#if defined( USE_PACKED_NORMALMAP )
		mapN = vec3( mapN.xy, sqrt( saturate( 1.0 - dot( mapN.xy, mapN.xy ) ) ) );
	#endif
	mapN.xy *= normalScale;
	normal = normalize( tbn * mapN );
#elif defined( USE_BUMPMAP )
	normal = perturbNormalArb( - vViewPosition, normal, dHdxy_fwd(), faceDirection );
#endif`,mb=`#ifndef FLAT_SHADED
	varying vec3 vNormal;
	#ifdef USE_TANGENT
		varying vec3 vTangent;
		varying vec3 vBitangent;
	#endif
#endif`,gb=`#ifndef FLAT_SHADED
	varying vec3 vNormal;
	#ifdef USE_TANGENT
		varying vec3 vTangent;
		varying vec3 vBitangent;
	#endif
#endif`,_b=`#ifndef FLAT_SHADED
	vNormal = normalize( transformedNormal );
	#ifdef USE_TANGENT
		vTangent = normalize( transformedTangent );
		vBitangent = normalize( cross( vNormal, vTangent ) * tangent.w );
		#ifdef FLIP_SIDED
			vBitangent = - vBitangent;
		#endif
	#endif
#endif`,xb=`#ifdef USE_NORMALMAP
	uniform sampler2D normalMap;
	uniform vec2 normalScale;
#endif
#ifdef USE_NORMALMAP_OBJECTSPACE
	uniform mat3 normalMatrix;
#endif
#if ! defined ( USE_TANGENT ) && ( defined ( USE_NORMALMAP_TANGENTSPACE ) || defined ( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY ) )
	mat3 getTangentFrame( vec3 eye_pos, vec3 surf_norm, vec2 uv ) {
		vec3 q0 = dFdx( eye_pos.xyz );
		vec3 q1 = dFdy( eye_pos.xyz );
		vec2 st0 = dFdx( uv.st );
		vec2 st1 = dFdy( uv.st );
		vec3 N = surf_norm;
		vec3 q1perp = cross( q1, N );
		vec3 q0perp = cross( N, q0 );
		vec3 T = q1perp * st0.x + q0perp * st1.x;
		vec3 B = q1perp * st0.y + q0perp * st1.y;
		float det = max( dot( T, T ), dot( B, B ) );
		float scale = ( det == 0.0 ) ? 0.0 : inversesqrt( det );
		return mat3( T * scale, B * scale, N );
	}
#endif`,vb=`#ifdef USE_CLEARCOAT
	vec3 clearcoatNormal = nonPerturbedNormal;
#endif`,yb=`#ifdef USE_CLEARCOAT_NORMALMAP
	vec3 clearcoatMapN = texture2D( clearcoatNormalMap, vClearcoatNormalMapUv ).xyz * 2.0 - 1.0;
	clearcoatMapN.xy *= clearcoatNormalScale;
	clearcoatNormal = normalize( tbn2 * clearcoatMapN );
#endif`,bb=`#ifdef USE_CLEARCOATMAP
	uniform sampler2D clearcoatMap;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	uniform sampler2D clearcoatNormalMap;
	uniform vec2 clearcoatNormalScale;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	uniform sampler2D clearcoatRoughnessMap;
#endif`,Sb=`#ifdef USE_IRIDESCENCEMAP
	uniform sampler2D iridescenceMap;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	uniform sampler2D iridescenceThicknessMap;
#endif`,Mb=`#ifdef OPAQUE
diffuseColor.a = 1.0;
#endif
#ifdef USE_TRANSMISSION
diffuseColor.a *= material.transmissionAlpha;
#endif
gl_FragColor = vec4( outgoingLight, diffuseColor.a );`,wb=`vec3 packNormalToRGB( const in vec3 normal ) {
	return normalize( normal ) * 0.5 + 0.5;
}
vec3 unpackRGBToNormal( const in vec3 rgb ) {
	return 2.0 * rgb.xyz - 1.0;
}
const float PackUpscale = 256. / 255.;const float UnpackDownscale = 255. / 256.;const float ShiftRight8 = 1. / 256.;
const float Inv255 = 1. / 255.;
const vec4 PackFactors = vec4( 1.0, 256.0, 256.0 * 256.0, 256.0 * 256.0 * 256.0 );
const vec2 UnpackFactors2 = vec2( UnpackDownscale, 1.0 / PackFactors.g );
const vec3 UnpackFactors3 = vec3( UnpackDownscale / PackFactors.rg, 1.0 / PackFactors.b );
const vec4 UnpackFactors4 = vec4( UnpackDownscale / PackFactors.rgb, 1.0 / PackFactors.a );
vec4 packDepthToRGBA( const in float v ) {
	if( v <= 0.0 )
		return vec4( 0., 0., 0., 0. );
	if( v >= 1.0 )
		return vec4( 1., 1., 1., 1. );
	float vuf;
	float af = modf( v * PackFactors.a, vuf );
	float bf = modf( vuf * ShiftRight8, vuf );
	float gf = modf( vuf * ShiftRight8, vuf );
	return vec4( vuf * Inv255, gf * PackUpscale, bf * PackUpscale, af );
}
vec3 packDepthToRGB( const in float v ) {
	if( v <= 0.0 )
		return vec3( 0., 0., 0. );
	if( v >= 1.0 )
		return vec3( 1., 1., 1. );
	float vuf;
	float bf = modf( v * PackFactors.b, vuf );
	float gf = modf( vuf * ShiftRight8, vuf );
	return vec3( vuf * Inv255, gf * PackUpscale, bf );
}
vec2 packDepthToRG( const in float v ) {
	if( v <= 0.0 )
		return vec2( 0., 0. );
	if( v >= 1.0 )
		return vec2( 1., 1. );
	float vuf;
	float gf = modf( v * 256., vuf );
	return vec2( vuf * Inv255, gf );
}
float unpackRGBAToDepth( const in vec4 v ) {
	return dot( v, UnpackFactors4 );
}
float unpackRGBToDepth( const in vec3 v ) {
	return dot( v, UnpackFactors3 );
}
float unpackRGToDepth( const in vec2 v ) {
	return v.r * UnpackFactors2.r + v.g * UnpackFactors2.g;
}
vec4 pack2HalfToRGBA( const in vec2 v ) {
	vec4 r = vec4( v.x, fract( v.x * 255.0 ), v.y, fract( v.y * 255.0 ) );
	return vec4( r.x - r.y / 255.0, r.y, r.z - r.w / 255.0, r.w );
}
vec2 unpackRGBATo2Half( const in vec4 v ) {
	return vec2( v.x + ( v.y / 255.0 ), v.z + ( v.w / 255.0 ) );
}
float viewZToOrthographicDepth( const in float viewZ, const in float near, const in float far ) {
	return ( viewZ + near ) / ( near - far );
}
float orthographicDepthToViewZ( const in float depth, const in float near, const in float far ) {
	#ifdef USE_REVERSED_DEPTH_BUFFER
	
		return depth * ( far - near ) - far;
	#else
		return depth * ( near - far ) - near;
	#endif
}
float viewZToPerspectiveDepth( const in float viewZ, const in float near, const in float far ) {
	return ( ( near + viewZ ) * far ) / ( ( far - near ) * viewZ );
}
float perspectiveDepthToViewZ( const in float depth, const in float near, const in float far ) {
	
	#ifdef USE_REVERSED_DEPTH_BUFFER
		return ( near * far ) / ( ( near - far ) * depth - near );
	#else
		return ( near * far ) / ( ( far - near ) * depth - far );
	#endif
}`,Tb=`#ifdef PREMULTIPLIED_ALPHA
	gl_FragColor.rgb *= gl_FragColor.a;
#endif`,Eb=`vec4 mvPosition = vec4( transformed, 1.0 );
#ifdef USE_BATCHING
	mvPosition = batchingMatrix * mvPosition;
#endif
#ifdef USE_INSTANCING
	mvPosition = instanceMatrix * mvPosition;
#endif
mvPosition = modelViewMatrix * mvPosition;
gl_Position = projectionMatrix * mvPosition;`,Ab=`#ifdef DITHERING
	gl_FragColor.rgb = dithering( gl_FragColor.rgb );
#endif`,Cb=`#ifdef DITHERING
	vec3 dithering( vec3 color ) {
		float grid_position = rand( gl_FragCoord.xy );
		vec3 dither_shift_RGB = vec3( 0.25 / 255.0, -0.25 / 255.0, 0.25 / 255.0 );
		dither_shift_RGB = mix( 2.0 * dither_shift_RGB, -2.0 * dither_shift_RGB, grid_position );
		return color + dither_shift_RGB;
	}
#endif`,Rb=`float roughnessFactor = roughness;
#ifdef USE_ROUGHNESSMAP
	vec4 texelRoughness = texture2D( roughnessMap, vRoughnessMapUv );
	roughnessFactor *= texelRoughness.g;
#endif`,Pb=`#ifdef USE_ROUGHNESSMAP
	uniform sampler2D roughnessMap;
#endif`,Ib=`#if NUM_SPOT_LIGHT_COORDS > 0
	varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#if NUM_SPOT_LIGHT_MAPS > 0
	uniform sampler2D spotLightMap[ NUM_SPOT_LIGHT_MAPS ];
#endif
#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
		#define SUN_LIGHT_CASCADES 2
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
		#else
			uniform sampler2D sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
		#endif
		uniform mat4 sunShadowMatrix[ NUM_SUN_LIGHT_SHADOWS * SUN_LIGHT_CASCADES ];
		uniform vec4 sunShadowCascade[ NUM_SUN_LIGHT_SHADOWS * SUN_LIGHT_CASCADES ];
		varying vec4 vSunShadowWorldPosition;
		varying vec3 vSunShadowWorldNormal;
		struct SunLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SunLightShadow sunLightShadows[ NUM_SUN_LIGHT_SHADOWS ];
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
		#else
			uniform sampler2D directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
		#endif
		varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
		struct DirectionalLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
		#else
			uniform sampler2D spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
		#endif
		struct SpotLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform samplerCubeShadow pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
		#elif defined( SHADOWMAP_TYPE_BASIC )
			uniform samplerCube pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
		#endif
		varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
		struct PointLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
			float shadowCameraNear;
			float shadowCameraFar;
		};
		uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
	#endif
	#if defined( SHADOWMAP_TYPE_PCF )
		float interleavedGradientNoise( vec2 position ) {
			return fract( 52.9829189 * fract( dot( position, vec2( 0.06711056, 0.00583715 ) ) ) );
		}
		vec2 vogelDiskSample( int sampleIndex, int samplesCount, float phi ) {
			const float goldenAngle = 2.399963229728653;
			float r = sqrt( ( float( sampleIndex ) + 0.5 ) / float( samplesCount ) );
			float theta = float( sampleIndex ) * goldenAngle + phi;
			return vec2( cos( theta ), sin( theta ) ) * r;
		}
	#endif
	#if defined( SHADOWMAP_TYPE_PCF )
		float getShadow( sampler2DShadow shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				vec2 texelSize = vec2( 1.0 ) / shadowMapSize;
				vec2 radius = shadowRadius * texelSize;
				float phi = interleavedGradientNoise( gl_FragCoord.xy ) * PI2;
				shadow = (
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 0, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 1, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 2, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 3, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 4, 5, phi ) * radius, shadowCoord.z ) )
				) * 0.2;
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#elif defined( SHADOWMAP_TYPE_VSM )
		float getShadow( sampler2D shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				vec2 distribution = texture2D( shadowMap, shadowCoord.xy ).rg;
				float mean = distribution.x;
				float variance = distribution.y * distribution.y;
				#ifdef USE_REVERSED_DEPTH_BUFFER
					float hard_shadow = step( mean, shadowCoord.z );
				#else
					float hard_shadow = step( shadowCoord.z, mean );
				#endif
				
				if ( hard_shadow == 1.0 ) {
					shadow = 1.0;
				} else {
					variance = max( variance, 0.0000001 );
					float d = shadowCoord.z - mean;
					float p_max = variance / ( variance + d * d );
					p_max = clamp( ( p_max - 0.3 ) / 0.65, 0.0, 1.0 );
					shadow = max( hard_shadow, p_max );
				}
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#else
		float getShadow( sampler2D shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				float depth = texture2D( shadowMap, shadowCoord.xy ).r;
				#ifdef USE_REVERSED_DEPTH_BUFFER
					shadow = step( depth, shadowCoord.z );
				#else
					shadow = step( shadowCoord.z, depth );
				#endif
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#endif
	#if NUM_SUN_LIGHT_SHADOWS > 0
		float getSunShadow(
			#if defined( SHADOWMAP_TYPE_PCF )
				sampler2DShadow shadowMap,
			#else
				sampler2D shadowMap,
			#endif
			SunLightShadow sunLightShadow,
			int shadowIndex
		) {
			vec4 shadowWorldPosition = vec4( vSunShadowWorldPosition.xyz + vSunShadowWorldNormal * sunLightShadow.shadowNormalBias, 1.0 );
			float viewDepth = vSunShadowWorldPosition.w;
			int cascadeOffset = shadowIndex * SUN_LIGHT_CASCADES;
			float shadow = 1.0;
			for ( int i = SUN_LIGHT_CASCADES - 1; i >= 0; i -- ) {
				vec4 cascade = sunShadowCascade[ cascadeOffset + i ];
				if ( viewDepth >= cascade.x && viewDepth < cascade.y ) {
					float cascadeShadow = getShadow(
						shadowMap,
						sunLightShadow.shadowMapSize,
						sunLightShadow.shadowIntensity,
						sunLightShadow.shadowBias,
						sunLightShadow.shadowRadius,
						sunShadowMatrix[ cascadeOffset + i ] * shadowWorldPosition
					);
					shadow = mix( cascadeShadow, shadow, smoothstep( cascade.z, cascade.y, viewDepth ) );
				}
			}
			return shadow;
		}
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
	#if defined( SHADOWMAP_TYPE_PCF )
	float getPointShadow( samplerCubeShadow shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord, float shadowCameraNear, float shadowCameraFar ) {
		float shadow = 1.0;
		vec3 lightToPosition = shadowCoord.xyz;
		vec3 bd3D = normalize( lightToPosition );
		vec3 absVec = abs( lightToPosition );
		float viewSpaceZ = max( max( absVec.x, absVec.y ), absVec.z );
		if ( viewSpaceZ - shadowCameraFar <= 0.0 && viewSpaceZ - shadowCameraNear >= 0.0 ) {
			float lightDistance = length( lightToPosition );
			float depthRange = shadowCameraFar - shadowCameraNear;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				float depthA = - shadowCameraNear / depthRange - shadowBias;
				float depthB = shadowCameraNear * shadowCameraFar / ( depthRange * lightDistance );
			#else
				float depthA = shadowCameraFar / depthRange + shadowBias;
				float depthB = - shadowCameraNear * shadowCameraFar / ( depthRange * lightDistance );
			#endif
			float texelSize = shadowRadius / shadowMapSize.x;
			vec3 absDir = abs( bd3D );
			vec3 tangent = absDir.x > absDir.z ? vec3( 0.0, 1.0, 0.0 ) : vec3( 1.0, 0.0, 0.0 );
			tangent = normalize( cross( bd3D, tangent ) );
			vec3 bitangent = cross( bd3D, tangent );
			float phi = interleavedGradientNoise( gl_FragCoord.xy ) * PI2;
			shadow = 0.0;
			for ( int i = 0; i < 5; i ++ ) {
				vec2 offset = vogelDiskSample( i, 5, phi );
				vec3 direction = bd3D + ( tangent * offset.x + bitangent * offset.y ) * texelSize;
				vec3 absDirection = abs( direction );
				float dp = depthA + depthB / max( max( absDirection.x, absDirection.y ), absDirection.z );
				shadow += texture( shadowMap, vec4( direction, dp ) );
			}
			shadow *= 0.2;
		}
		return mix( 1.0, shadow, shadowIntensity );
	}
	#elif defined( SHADOWMAP_TYPE_BASIC )
	float getPointShadow( samplerCube shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord, float shadowCameraNear, float shadowCameraFar ) {
		float shadow = 1.0;
		vec3 lightToPosition = shadowCoord.xyz;
		vec3 absVec = abs( lightToPosition );
		float viewSpaceZ = max( max( absVec.x, absVec.y ), absVec.z );
		if ( viewSpaceZ - shadowCameraFar <= 0.0 && viewSpaceZ - shadowCameraNear >= 0.0 ) {
			float dp = ( shadowCameraFar * ( viewSpaceZ - shadowCameraNear ) ) / ( viewSpaceZ * ( shadowCameraFar - shadowCameraNear ) );
			dp += shadowBias;
			vec3 bd3D = normalize( lightToPosition );
			float depth = textureCube( shadowMap, bd3D ).r;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				depth = 1.0 - depth;
			#endif
			shadow = step( dp, depth );
		}
		return mix( 1.0, shadow, shadowIntensity );
	}
	#endif
	#endif
#endif`,Lb=`#if NUM_SPOT_LIGHT_COORDS > 0
	uniform mat4 spotLightMatrix[ NUM_SPOT_LIGHT_COORDS ];
	varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
		varying vec4 vSunShadowWorldPosition;
		varying vec3 vSunShadowWorldNormal;
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		uniform mat4 directionalShadowMatrix[ NUM_DIR_LIGHT_SHADOWS ];
		varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
		struct DirectionalLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
		struct SpotLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		uniform mat4 pointShadowMatrix[ NUM_POINT_LIGHT_SHADOWS ];
		varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
		struct PointLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
			float shadowCameraNear;
			float shadowCameraFar;
		};
		uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
	#endif
#endif`,Db=`#if ( defined( USE_SHADOWMAP ) && ( NUM_DIR_LIGHT_SHADOWS > 0 || NUM_SUN_LIGHT_SHADOWS > 0 || NUM_POINT_LIGHT_SHADOWS > 0 ) ) || ( NUM_SPOT_LIGHT_COORDS > 0 )
	#ifdef HAS_NORMAL
		vec3 shadowWorldNormal = transformNormalByInverseViewMatrix( transformedNormal, viewMatrix );
	#else
		vec3 shadowWorldNormal = vec3( 0.0 );
	#endif
	vec4 shadowWorldPosition;
#endif
#if defined( USE_SHADOWMAP )
	#if NUM_SUN_LIGHT_SHADOWS > 0
		vSunShadowWorldPosition = vec4( worldPosition.xyz, - mvPosition.z );
		vSunShadowWorldNormal = shadowWorldNormal;
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_DIR_LIGHT_SHADOWS; i ++ ) {
			shadowWorldPosition = worldPosition + vec4( shadowWorldNormal * directionalLightShadows[ i ].shadowNormalBias, 0 );
			vDirectionalShadowCoord[ i ] = directionalShadowMatrix[ i ] * shadowWorldPosition;
		}
		#pragma unroll_loop_end
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_POINT_LIGHT_SHADOWS; i ++ ) {
			shadowWorldPosition = worldPosition + vec4( shadowWorldNormal * pointLightShadows[ i ].shadowNormalBias, 0 );
			vPointShadowCoord[ i ] = pointShadowMatrix[ i ] * shadowWorldPosition;
		}
		#pragma unroll_loop_end
	#endif
#endif
#if NUM_SPOT_LIGHT_COORDS > 0
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHT_COORDS; i ++ ) {
		shadowWorldPosition = worldPosition;
		#if ( defined( USE_SHADOWMAP ) && UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
			shadowWorldPosition.xyz += shadowWorldNormal * spotLightShadows[ i ].shadowNormalBias;
		#endif
		vSpotLightCoord[ i ] = spotLightMatrix[ i ] * shadowWorldPosition;
	}
	#pragma unroll_loop_end
#endif`,Nb=`float getShadowMask() {
	float shadow = 1.0;
	#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
	SunLightShadow sunLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SUN_LIGHT_SHADOWS; i ++ ) {
		sunLight = sunLightShadows[ i ];
		shadow *= receiveShadow ? getSunShadow( sunShadowMap[ i ], sunLight, UNROLLED_LOOP_INDEX ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
	DirectionalLightShadow directionalLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_DIR_LIGHT_SHADOWS; i ++ ) {
		directionalLight = directionalLightShadows[ i ];
		shadow *= receiveShadow ? getShadow( directionalShadowMap[ i ], directionalLight.shadowMapSize, directionalLight.shadowIntensity, directionalLight.shadowBias, directionalLight.shadowRadius, vDirectionalShadowCoord[ i ] ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
	SpotLightShadow spotLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHT_SHADOWS; i ++ ) {
		spotLight = spotLightShadows[ i ];
		shadow *= receiveShadow ? getShadow( spotShadowMap[ i ], spotLight.shadowMapSize, spotLight.shadowIntensity, spotLight.shadowBias, spotLight.shadowRadius, vSpotLightCoord[ i ] ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0 && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
	PointLightShadow pointLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_POINT_LIGHT_SHADOWS; i ++ ) {
		pointLight = pointLightShadows[ i ];
		shadow *= receiveShadow ? getPointShadow( pointShadowMap[ i ], pointLight.shadowMapSize, pointLight.shadowIntensity, pointLight.shadowBias, pointLight.shadowRadius, vPointShadowCoord[ i ], pointLight.shadowCameraNear, pointLight.shadowCameraFar ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#endif
	return shadow;
}`,Ub=`#ifdef USE_SKINNING
	mat4 boneMatX = getBoneMatrix( skinIndex.x );
	mat4 boneMatY = getBoneMatrix( skinIndex.y );
	mat4 boneMatZ = getBoneMatrix( skinIndex.z );
	mat4 boneMatW = getBoneMatrix( skinIndex.w );
#endif`,Ob=`#ifdef USE_SKINNING
	uniform mat4 bindMatrix;
	uniform mat4 bindMatrixInverse;
	uniform highp sampler2D boneTexture;
	mat4 getBoneMatrix( const in float i ) {
		int size = textureSize( boneTexture, 0 ).x;
		int j = int( i ) * 4;
		int x = j % size;
		int y = j / size;
		vec4 v1 = texelFetch( boneTexture, ivec2( x, y ), 0 );
		vec4 v2 = texelFetch( boneTexture, ivec2( x + 1, y ), 0 );
		vec4 v3 = texelFetch( boneTexture, ivec2( x + 2, y ), 0 );
		vec4 v4 = texelFetch( boneTexture, ivec2( x + 3, y ), 0 );
		return mat4( v1, v2, v3, v4 );
	}
#endif`,Fb=`#ifdef USE_SKINNING
	vec4 skinVertex = bindMatrix * vec4( transformed, 1.0 );
	vec4 skinned = vec4( 0.0 );
	skinned += boneMatX * skinVertex * skinWeight.x;
	skinned += boneMatY * skinVertex * skinWeight.y;
	skinned += boneMatZ * skinVertex * skinWeight.z;
	skinned += boneMatW * skinVertex * skinWeight.w;
	transformed = ( bindMatrixInverse * skinned ).xyz;
#endif`,kb=`#ifdef USE_SKINNING
	mat4 skinMatrix = mat4( 0.0 );
	skinMatrix += skinWeight.x * boneMatX;
	skinMatrix += skinWeight.y * boneMatY;
	skinMatrix += skinWeight.z * boneMatZ;
	skinMatrix += skinWeight.w * boneMatW;
	skinMatrix = bindMatrixInverse * skinMatrix * bindMatrix;
	objectNormal = vec4( skinMatrix * vec4( objectNormal, 0.0 ) ).xyz;
	#ifdef USE_TANGENT
		objectTangent = vec4( skinMatrix * vec4( objectTangent, 0.0 ) ).xyz;
	#endif
#endif`,Bb=`float specularStrength;
#ifdef USE_SPECULARMAP
	vec4 texelSpecular = texture2D( specularMap, vSpecularMapUv );
	specularStrength = texelSpecular.r;
#else
	specularStrength = 1.0;
#endif`,zb=`#ifdef USE_SPECULARMAP
	uniform sampler2D specularMap;
#endif`,Vb=`#if defined( TONE_MAPPING )
	gl_FragColor.rgb = toneMapping( gl_FragColor.rgb );
#endif`,Gb=`#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
uniform float toneMappingExposure;
vec3 LinearToneMapping( vec3 color ) {
	return saturate( toneMappingExposure * color );
}
vec3 ReinhardToneMapping( vec3 color ) {
	color *= toneMappingExposure;
	return saturate( color / ( vec3( 1.0 ) + color ) );
}
vec3 CineonToneMapping( vec3 color ) {
	color *= toneMappingExposure;
	color = max( vec3( 0.0 ), color - 0.004 );
	return pow( ( color * ( 6.2 * color + 0.5 ) ) / ( color * ( 6.2 * color + 1.7 ) + 0.06 ), vec3( 2.2 ) );
}
vec3 RRTAndODTFit( vec3 v ) {
	vec3 a = v * ( v + 0.0245786 ) - 0.000090537;
	vec3 b = v * ( 0.983729 * v + 0.4329510 ) + 0.238081;
	return a / b;
}
vec3 ACESFilmicToneMapping( vec3 color ) {
	const mat3 ACESInputMat = mat3(
		vec3( 0.59719, 0.07600, 0.02840 ),		vec3( 0.35458, 0.90834, 0.13383 ),
		vec3( 0.04823, 0.01566, 0.83777 )
	);
	const mat3 ACESOutputMat = mat3(
		vec3(  1.60475, -0.10208, -0.00327 ),		vec3( -0.53108,  1.10813, -0.07276 ),
		vec3( -0.07367, -0.00605,  1.07602 )
	);
	color *= toneMappingExposure / 0.6;
	color = ACESInputMat * color;
	color = RRTAndODTFit( color );
	color = ACESOutputMat * color;
	return saturate( color );
}
const mat3 LINEAR_REC2020_TO_LINEAR_SRGB = mat3(
	vec3( 1.6605, - 0.1246, - 0.0182 ),
	vec3( - 0.5876, 1.1329, - 0.1006 ),
	vec3( - 0.0728, - 0.0083, 1.1187 )
);
const mat3 LINEAR_SRGB_TO_LINEAR_REC2020 = mat3(
	vec3( 0.6274, 0.0691, 0.0164 ),
	vec3( 0.3293, 0.9195, 0.0880 ),
	vec3( 0.0433, 0.0113, 0.8956 )
);
vec3 agxDefaultContrastApprox( vec3 x ) {
	vec3 x2 = x * x;
	vec3 x4 = x2 * x2;
	return + 15.5 * x4 * x2
		- 40.14 * x4 * x
		+ 31.96 * x4
		- 6.868 * x2 * x
		+ 0.4298 * x2
		+ 0.1191 * x
		- 0.00232;
}
vec3 AgXToneMapping( vec3 color ) {
	const mat3 AgXInsetMatrix = mat3(
		vec3( 0.856627153315983, 0.137318972929847, 0.11189821299995 ),
		vec3( 0.0951212405381588, 0.761241990602591, 0.0767994186031903 ),
		vec3( 0.0482516061458583, 0.101439036467562, 0.811302368396859 )
	);
	const mat3 AgXOutsetMatrix = mat3(
		vec3( 1.1271005818144368, - 0.1413297634984383, - 0.14132976349843826 ),
		vec3( - 0.11060664309660323, 1.157823702216272, - 0.11060664309660294 ),
		vec3( - 0.016493938717834573, - 0.016493938717834257, 1.2519364065950405 )
	);
	const float AgxMinEv = - 12.47393;	const float AgxMaxEv = 4.026069;
	color *= toneMappingExposure;
	color = LINEAR_SRGB_TO_LINEAR_REC2020 * color;
	color = AgXInsetMatrix * color;
	color = max( color, 1e-10 );	color = log2( color );
	color = ( color - AgxMinEv ) / ( AgxMaxEv - AgxMinEv );
	color = clamp( color, 0.0, 1.0 );
	color = agxDefaultContrastApprox( color );
	color = AgXOutsetMatrix * color;
	color = pow( max( vec3( 0.0 ), color ), vec3( 2.2 ) );
	color = LINEAR_REC2020_TO_LINEAR_SRGB * color;
	color = clamp( color, 0.0, 1.0 );
	return color;
}
vec3 NeutralToneMapping( vec3 color ) {
	const float StartCompression = 0.8 - 0.04;
	const float Desaturation = 0.15;
	color *= toneMappingExposure;
	float x = min( color.r, min( color.g, color.b ) );
	float offset = x < 0.08 ? x - 6.25 * x * x : 0.04;
	color -= offset;
	float peak = max( color.r, max( color.g, color.b ) );
	if ( peak < StartCompression ) return color;
	float d = 1. - StartCompression;
	float newPeak = 1. - d * d / ( peak + d - StartCompression );
	color *= newPeak / peak;
	float g = 1. - 1. / ( Desaturation * ( peak - newPeak ) + 1. );
	return mix( color, vec3( newPeak ), g );
}
vec3 CustomToneMapping( vec3 color ) { return color; }`,Hb=`#ifdef USE_TRANSMISSION
	material.transmission = transmission;
	material.transmissionAlpha = 1.0;
	material.thickness = thickness;
	material.attenuationDistance = attenuationDistance;
	material.attenuationColor = attenuationColor;
	#ifdef USE_TRANSMISSIONMAP
		material.transmission *= texture2D( transmissionMap, vTransmissionMapUv ).r;
	#endif
	#ifdef USE_THICKNESSMAP
		material.thickness *= texture2D( thicknessMap, vThicknessMapUv ).g;
	#endif
	vec3 pos = vWorldPosition;
	vec3 v = normalize( cameraPosition - pos );
	vec3 n = transformNormalByInverseViewMatrix( normal, viewMatrix );
	vec4 transmitted = getIBLVolumeRefraction(
		n, v, material.roughness, material.diffuseContribution, material.specularColorBlended, material.specularF90,
		pos, modelMatrix, viewMatrix, projectionMatrix, material.dispersion, material.ior, material.thickness,
		material.attenuationColor, material.attenuationDistance );
	material.transmissionAlpha = mix( material.transmissionAlpha, transmitted.a, material.transmission );
	totalDiffuse = mix( totalDiffuse, transmitted.rgb, material.transmission );
#endif`,Wb=`#ifdef USE_TRANSMISSION
	uniform float transmission;
	uniform float thickness;
	uniform float attenuationDistance;
	uniform vec3 attenuationColor;
	#ifdef USE_TRANSMISSIONMAP
		uniform sampler2D transmissionMap;
	#endif
	#ifdef USE_THICKNESSMAP
		uniform sampler2D thicknessMap;
	#endif
	uniform vec2 transmissionSamplerSize;
	uniform sampler2D transmissionSamplerMap;
	uniform mat4 modelMatrix;
	uniform mat4 projectionMatrix;
	varying vec3 vWorldPosition;
	float w0( float a ) {
		return ( 1.0 / 6.0 ) * ( a * ( a * ( - a + 3.0 ) - 3.0 ) + 1.0 );
	}
	float w1( float a ) {
		return ( 1.0 / 6.0 ) * ( a *  a * ( 3.0 * a - 6.0 ) + 4.0 );
	}
	float w2( float a ){
		return ( 1.0 / 6.0 ) * ( a * ( a * ( - 3.0 * a + 3.0 ) + 3.0 ) + 1.0 );
	}
	float w3( float a ) {
		return ( 1.0 / 6.0 ) * ( a * a * a );
	}
	float g0( float a ) {
		return w0( a ) + w1( a );
	}
	float g1( float a ) {
		return w2( a ) + w3( a );
	}
	float h0( float a ) {
		return - 1.0 + w1( a ) / ( w0( a ) + w1( a ) );
	}
	float h1( float a ) {
		return 1.0 + w3( a ) / ( w2( a ) + w3( a ) );
	}
	vec4 bicubic( sampler2D tex, vec2 uv, vec4 texelSize, float lod ) {
		uv = uv * texelSize.zw + 0.5;
		vec2 iuv = floor( uv );
		vec2 fuv = fract( uv );
		float g0x = g0( fuv.x );
		float g1x = g1( fuv.x );
		float h0x = h0( fuv.x );
		float h1x = h1( fuv.x );
		float h0y = h0( fuv.y );
		float h1y = h1( fuv.y );
		vec2 p0 = ( vec2( iuv.x + h0x, iuv.y + h0y ) - 0.5 ) * texelSize.xy;
		vec2 p1 = ( vec2( iuv.x + h1x, iuv.y + h0y ) - 0.5 ) * texelSize.xy;
		vec2 p2 = ( vec2( iuv.x + h0x, iuv.y + h1y ) - 0.5 ) * texelSize.xy;
		vec2 p3 = ( vec2( iuv.x + h1x, iuv.y + h1y ) - 0.5 ) * texelSize.xy;
		return g0( fuv.y ) * ( g0x * textureLod( tex, p0, lod ) + g1x * textureLod( tex, p1, lod ) ) +
			g1( fuv.y ) * ( g0x * textureLod( tex, p2, lod ) + g1x * textureLod( tex, p3, lod ) );
	}
	vec4 textureBicubic( sampler2D sampler, vec2 uv, float lod ) {
		vec2 fLodSize = vec2( textureSize( sampler, int( lod ) ) );
		vec2 cLodSize = vec2( textureSize( sampler, int( lod + 1.0 ) ) );
		vec2 fLodSizeInv = 1.0 / fLodSize;
		vec2 cLodSizeInv = 1.0 / cLodSize;
		vec4 fSample = bicubic( sampler, uv, vec4( fLodSizeInv, fLodSize ), floor( lod ) );
		vec4 cSample = bicubic( sampler, uv, vec4( cLodSizeInv, cLodSize ), ceil( lod ) );
		return mix( fSample, cSample, fract( lod ) );
	}
	vec3 getVolumeTransmissionRay( const in vec3 n, const in vec3 v, const in float thickness, const in float ior, const in mat4 modelMatrix ) {
		vec3 refractionVector = refract( - v, normalize( n ), 1.0 / ior );
		vec3 modelScale;
		modelScale.x = length( vec3( modelMatrix[ 0 ].xyz ) );
		modelScale.y = length( vec3( modelMatrix[ 1 ].xyz ) );
		modelScale.z = length( vec3( modelMatrix[ 2 ].xyz ) );
		return normalize( refractionVector ) * thickness * modelScale;
	}
	float applyIorToRoughness( const in float roughness, const in float ior ) {
		return roughness * clamp( ior * 2.0 - 2.0, 0.0, 1.0 );
	}
	vec4 getTransmissionSample( const in vec2 fragCoord, const in float roughness, const in float ior ) {
		float lod = log2( transmissionSamplerSize.x ) * applyIorToRoughness( roughness, ior );
		return textureBicubic( transmissionSamplerMap, fragCoord.xy, lod );
	}
	vec3 volumeAttenuation( const in float transmissionDistance, const in vec3 attenuationColor, const in float attenuationDistance ) {
		if ( isinf( attenuationDistance ) ) {
			return vec3( 1.0 );
		} else {
			vec3 attenuationCoefficient = -log( attenuationColor ) / attenuationDistance;
			vec3 transmittance = exp( - attenuationCoefficient * transmissionDistance );			return transmittance;
		}
	}
	vec4 getIBLVolumeRefraction( const in vec3 n, const in vec3 v, const in float roughness, const in vec3 diffuseColor,
		const in vec3 specularColor, const in float specularF90, const in vec3 position, const in mat4 modelMatrix,
		const in mat4 viewMatrix, const in mat4 projMatrix, const in float dispersion, const in float ior, const in float thickness,
		const in vec3 attenuationColor, const in float attenuationDistance ) {
		vec4 transmittedLight;
		vec3 transmittance;
		#ifdef USE_DISPERSION
			float halfSpread = ( ior - 1.0 ) * 0.025 * dispersion;
			vec3 iors = vec3( ior - halfSpread, ior, ior + halfSpread );
			for ( int i = 0; i < 3; i ++ ) {
				vec3 transmissionRay = getVolumeTransmissionRay( n, v, thickness, iors[ i ], modelMatrix );
				vec3 refractedRayExit = position + transmissionRay;
				vec4 ndcPos = projMatrix * viewMatrix * vec4( refractedRayExit, 1.0 );
				vec2 refractionCoords = ndcPos.xy / ndcPos.w;
				refractionCoords += 1.0;
				refractionCoords /= 2.0;
				vec4 transmissionSample = getTransmissionSample( refractionCoords, roughness, iors[ i ] );
				transmittedLight[ i ] = transmissionSample[ i ];
				transmittedLight.a += transmissionSample.a;
				transmittance[ i ] = diffuseColor[ i ] * volumeAttenuation( length( transmissionRay ), attenuationColor, attenuationDistance )[ i ];
			}
			transmittedLight.a /= 3.0;
		#else
			vec3 transmissionRay = getVolumeTransmissionRay( n, v, thickness, ior, modelMatrix );
			vec3 refractedRayExit = position + transmissionRay;
			vec4 ndcPos = projMatrix * viewMatrix * vec4( refractedRayExit, 1.0 );
			vec2 refractionCoords = ndcPos.xy / ndcPos.w;
			refractionCoords += 1.0;
			refractionCoords /= 2.0;
			transmittedLight = getTransmissionSample( refractionCoords, roughness, ior );
			transmittance = diffuseColor * volumeAttenuation( length( transmissionRay ), attenuationColor, attenuationDistance );
		#endif
		vec3 attenuatedColor = transmittance * transmittedLight.rgb;
		vec3 F = EnvironmentBRDF( n, v, specularColor, specularF90, roughness );
		float transmittanceFactor = ( transmittance.r + transmittance.g + transmittance.b ) / 3.0;
		return vec4( ( 1.0 - F ) * attenuatedColor, 1.0 - ( 1.0 - transmittedLight.a ) * transmittanceFactor );
	}
#endif`,Xb=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	varying vec2 vUv;
#endif
#ifdef USE_MAP
	varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
	varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
	varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
	varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
	varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
	varying vec2 vNormalMapUv;
#endif
#ifdef USE_EMISSIVEMAP
	varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
	varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
	varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
	varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
	varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
	varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
	varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_SPECULARMAP
	varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
	varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
	uniform mat3 transmissionMapTransform;
	varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
	uniform mat3 thicknessMapTransform;
	varying vec2 vThicknessMapUv;
#endif`,qb=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	varying vec2 vUv;
#endif
#ifdef USE_MAP
	uniform mat3 mapTransform;
	varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
	uniform mat3 alphaMapTransform;
	varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
	uniform mat3 lightMapTransform;
	varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
	uniform mat3 aoMapTransform;
	varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
	uniform mat3 bumpMapTransform;
	varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
	uniform mat3 normalMapTransform;
	varying vec2 vNormalMapUv;
#endif
#ifdef USE_DISPLACEMENTMAP
	uniform mat3 displacementMapTransform;
	varying vec2 vDisplacementMapUv;
#endif
#ifdef USE_EMISSIVEMAP
	uniform mat3 emissiveMapTransform;
	varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
	uniform mat3 metalnessMapTransform;
	varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
	uniform mat3 roughnessMapTransform;
	varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	uniform mat3 diffuseRoughnessMapTransform;
	varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
	uniform mat3 anisotropyMapTransform;
	varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
	uniform mat3 clearcoatMapTransform;
	varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	uniform mat3 clearcoatNormalMapTransform;
	varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	uniform mat3 clearcoatRoughnessMapTransform;
	varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
	uniform mat3 sheenColorMapTransform;
	varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	uniform mat3 sheenRoughnessMapTransform;
	varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
	uniform mat3 iridescenceMapTransform;
	varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	uniform mat3 iridescenceThicknessMapTransform;
	varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SPECULARMAP
	uniform mat3 specularMapTransform;
	varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
	uniform mat3 specularColorMapTransform;
	varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	uniform mat3 specularIntensityMapTransform;
	varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
	uniform mat3 transmissionMapTransform;
	varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
	uniform mat3 thicknessMapTransform;
	varying vec2 vThicknessMapUv;
#endif`,Yb=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	vUv = vec3( uv, 1 ).xy;
#endif
#ifdef USE_MAP
	vMapUv = ( mapTransform * vec3( MAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ALPHAMAP
	vAlphaMapUv = ( alphaMapTransform * vec3( ALPHAMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_LIGHTMAP
	vLightMapUv = ( lightMapTransform * vec3( LIGHTMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_AOMAP
	vAoMapUv = ( aoMapTransform * vec3( AOMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_BUMPMAP
	vBumpMapUv = ( bumpMapTransform * vec3( BUMPMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_NORMALMAP
	vNormalMapUv = ( normalMapTransform * vec3( NORMALMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_DISPLACEMENTMAP
	vDisplacementMapUv = ( displacementMapTransform * vec3( DISPLACEMENTMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_EMISSIVEMAP
	vEmissiveMapUv = ( emissiveMapTransform * vec3( EMISSIVEMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_METALNESSMAP
	vMetalnessMapUv = ( metalnessMapTransform * vec3( METALNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ROUGHNESSMAP
	vRoughnessMapUv = ( roughnessMapTransform * vec3( ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	vDiffuseRoughnessMapUv = ( diffuseRoughnessMapTransform * vec3( DIFFUSE_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ANISOTROPYMAP
	vAnisotropyMapUv = ( anisotropyMapTransform * vec3( ANISOTROPYMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOATMAP
	vClearcoatMapUv = ( clearcoatMapTransform * vec3( CLEARCOATMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	vClearcoatNormalMapUv = ( clearcoatNormalMapTransform * vec3( CLEARCOAT_NORMALMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	vClearcoatRoughnessMapUv = ( clearcoatRoughnessMapTransform * vec3( CLEARCOAT_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCEMAP
	vIridescenceMapUv = ( iridescenceMapTransform * vec3( IRIDESCENCEMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	vIridescenceThicknessMapUv = ( iridescenceThicknessMapTransform * vec3( IRIDESCENCE_THICKNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SHEEN_COLORMAP
	vSheenColorMapUv = ( sheenColorMapTransform * vec3( SHEEN_COLORMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	vSheenRoughnessMapUv = ( sheenRoughnessMapTransform * vec3( SHEEN_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULARMAP
	vSpecularMapUv = ( specularMapTransform * vec3( SPECULARMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULAR_COLORMAP
	vSpecularColorMapUv = ( specularColorMapTransform * vec3( SPECULAR_COLORMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	vSpecularIntensityMapUv = ( specularIntensityMapTransform * vec3( SPECULAR_INTENSITYMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_TRANSMISSIONMAP
	vTransmissionMapUv = ( transmissionMapTransform * vec3( TRANSMISSIONMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_THICKNESSMAP
	vThicknessMapUv = ( thicknessMapTransform * vec3( THICKNESSMAP_UV, 1 ) ).xy;
#endif`,$b=`#if defined( USE_ENVMAP ) || defined( DISTANCE ) || defined ( USE_SHADOWMAP ) || defined ( USE_TRANSMISSION ) || NUM_SPOT_LIGHT_COORDS > 0
	vec4 worldPosition = vec4( transformed, 1.0 );
	#ifdef USE_BATCHING
		worldPosition = batchingMatrix * worldPosition;
	#endif
	#ifdef USE_INSTANCING
		worldPosition = instanceMatrix * worldPosition;
	#endif
	worldPosition = modelMatrix * worldPosition;
#endif`,Zb=`varying vec2 vUv;
uniform mat3 uvTransform;
void main() {
	vUv = ( uvTransform * vec3( uv, 1 ) ).xy;
	gl_Position = vec4( position.xy, 1.0, 1.0 );
}`,Jb=`uniform sampler2D t2D;
uniform float backgroundIntensity;
varying vec2 vUv;
void main() {
	vec4 texColor = texture2D( t2D, vUv );
	#ifdef DECODE_VIDEO_TEXTURE
		texColor = vec4( mix( pow( texColor.rgb * 0.9478672986 + vec3( 0.0521327014 ), vec3( 2.4 ) ), texColor.rgb * 0.0773993808, vec3( lessThanEqual( texColor.rgb, vec3( 0.04045 ) ) ) ), texColor.w );
	#endif
	texColor.rgb *= backgroundIntensity;
	gl_FragColor = texColor;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,Kb=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
	gl_Position.z = gl_Position.w;
}`,jb=`uniform float backgroundBlurriness;
uniform float backgroundIntensity;
uniform mat3 backgroundRotation;
varying vec3 vWorldDirection;
#include <envmap_common_pars_fragment>
void main() {
	#ifdef ENVMAP_TYPE_PMREM
		vec4 texColor = textureLod( envMap, backgroundRotation * vWorldDirection, roughnessToMip( backgroundBlurriness ) );
	#else
		vec4 texColor = textureCube( envMap, backgroundRotation * vWorldDirection );
	#endif
	texColor.rgb *= backgroundIntensity;
	gl_FragColor = texColor;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,Qb=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
	gl_Position.z = gl_Position.w;
}`,eS=`uniform samplerCube tCube;
uniform float tFlip;
uniform float opacity;
varying vec3 vWorldDirection;
void main() {
	vec4 texColor = textureCube( tCube, vec3( tFlip * vWorldDirection.x, vWorldDirection.yz ) );
	gl_FragColor = texColor;
	gl_FragColor.a *= opacity;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,tS=`#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
varying vec2 vHighPrecisionZW;
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <skinbase_vertex>
	#include <morphinstance_vertex>
	#ifdef USE_DISPLACEMENTMAP
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vHighPrecisionZW = gl_Position.zw;
}`,nS=`#if DEPTH_PACKING == 3200
	uniform float opacity;
#endif
#include <common>
#include <packing>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
varying vec2 vHighPrecisionZW;
void main() {
	vec4 diffuseColor = vec4( 1.0 );
	#include <clipping_planes_fragment>
	#if DEPTH_PACKING == 3200
		diffuseColor.a = opacity;
	#endif
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <logdepthbuf_fragment>
	#ifdef USE_REVERSED_DEPTH_BUFFER
		float fragCoordZ = vHighPrecisionZW[ 0 ] / vHighPrecisionZW[ 1 ];
	#else
		float fragCoordZ = 0.5 * vHighPrecisionZW[ 0 ] / vHighPrecisionZW[ 1 ] + 0.5;
	#endif
	#if DEPTH_PACKING == 3200
		gl_FragColor = vec4( vec3( 1.0 - fragCoordZ ), opacity );
	#elif DEPTH_PACKING == 3201
		gl_FragColor = packDepthToRGBA( fragCoordZ );
	#elif DEPTH_PACKING == 3202
		gl_FragColor = vec4( packDepthToRGB( fragCoordZ ), 1.0 );
	#elif DEPTH_PACKING == 3203
		gl_FragColor = vec4( packDepthToRG( fragCoordZ ), 0.0, 1.0 );
	#endif
}`,iS=`#define DISTANCE
varying vec3 vWorldPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <skinbase_vertex>
	#include <morphinstance_vertex>
	#ifdef USE_DISPLACEMENTMAP
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <worldpos_vertex>
	#include <clipping_planes_vertex>
	vWorldPosition = worldPosition.xyz;
}`,sS=`#define DISTANCE
uniform vec3 referencePosition;
uniform float nearDistance;
uniform float farDistance;
varying vec3 vWorldPosition;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( 1.0 );
	#include <clipping_planes_fragment>
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	float dist = length( vWorldPosition - referencePosition );
	dist = ( dist - nearDistance ) / ( farDistance - nearDistance );
	dist = saturate( dist );
	gl_FragColor = vec4( dist, 0.0, 0.0, 1.0 );
}`,rS=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
}`,oS=`uniform sampler2D tEquirect;
varying vec3 vWorldDirection;
#include <common>
void main() {
	vec3 direction = normalize( vWorldDirection );
	vec2 sampleUV = equirectUv( direction );
	gl_FragColor = texture2D( tEquirect, sampleUV );
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,aS=`uniform float scale;
attribute float lineDistance;
varying float vLineDistance;
#include <common>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	vLineDistance = scale * lineDistance;
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
}`,lS=`uniform vec3 diffuse;
uniform float opacity;
uniform float dashSize;
uniform float totalSize;
varying float vLineDistance;
#include <common>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	if ( mod( vLineDistance, totalSize ) > dashSize ) {
		discard;
	}
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,cS=`#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#if defined ( USE_ENVMAP ) || defined ( USE_SKINNING )
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinbase_vertex>
		#include <skinnormal_vertex>
		#include <defaultnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <fog_vertex>
}`,uS=`uniform vec3 diffuse;
uniform float opacity;
#ifndef FLAT_SHADED
	varying vec3 vNormal;
#endif
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <fog_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	#ifdef USE_LIGHTMAP
		vec4 lightMapTexel = texture2D( lightMap, vLightMapUv );
		reflectedLight.indirectDiffuse += lightMapTexel.rgb * lightMapIntensity * RECIPROCAL_PI;
	#else
		reflectedLight.indirectDiffuse += vec3( 1.0 );
	#endif
	#include <aomap_fragment>
	reflectedLight.indirectDiffuse *= diffuseColor.rgb;
	vec3 outgoingLight = reflectedLight.indirectDiffuse;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,hS=`#define LAMBERT
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,dS=`#define LAMBERT
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_lambert_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_lambert_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + totalEmissiveRadiance;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,fS=`#define MATCAP
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <displacementmap_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
	vViewPosition = - mvPosition.xyz;
}`,pS=`#define MATCAP
uniform vec3 diffuse;
uniform float opacity;
uniform sampler2D matcap;
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	vec3 viewDir = normalize( vViewPosition );
	vec3 x = normalize( vec3( viewDir.z, 0.0, - viewDir.x ) );
	vec3 y = cross( viewDir, x );
	vec2 uv = vec2( dot( x, normal ), dot( y, normal ) ) * 0.495 + 0.5;
	#ifdef USE_MATCAP
		vec4 matcapColor = texture2D( matcap, uv );
	#else
		vec4 matcapColor = vec4( vec3( mix( 0.2, 0.8, uv.y ) ), 1.0 );
	#endif
	vec3 outgoingLight = diffuseColor.rgb * matcapColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,mS=`#define NORMAL
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	varying vec3 vViewPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	vViewPosition = - mvPosition.xyz;
#endif
}`,gS=`#define NORMAL
uniform float opacity;
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	varying vec3 vViewPosition;
#endif
#include <uv_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( 0.0, 0.0, 0.0, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	gl_FragColor = vec4( normalize( normal ) * 0.5 + 0.5, diffuseColor.a );
	#ifdef OPAQUE
		gl_FragColor.a = 1.0;
	#endif
}`,_S=`#define PHONG
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,xS=`#define PHONG
uniform vec3 diffuse;
uniform vec3 emissive;
uniform vec3 specular;
uniform float shininess;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_phong_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_phong_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + reflectedLight.directSpecular + reflectedLight.indirectSpecular + totalEmissiveRadiance;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,vS=`#define STANDARD
varying vec3 vViewPosition;
#ifdef USE_TRANSMISSION
	varying vec3 vWorldPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
#ifdef USE_TRANSMISSION
	vWorldPosition = worldPosition.xyz;
#endif
}`,yS=`#define STANDARD
#ifdef PHYSICAL
	#define IOR
	#define USE_SPECULAR
#endif
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float roughness;
uniform float metalness;
uniform float opacity;
#ifdef IOR
	uniform float ior;
#endif
#ifdef USE_SPECULAR
	uniform float specularIntensity;
	uniform vec3 specularColor;
	#ifdef USE_SPECULAR_COLORMAP
		uniform sampler2D specularColorMap;
	#endif
	#ifdef USE_SPECULAR_INTENSITYMAP
		uniform sampler2D specularIntensityMap;
	#endif
#endif
#ifdef USE_CLEARCOAT
	uniform float clearcoat;
	uniform float clearcoatRoughness;
#endif
#ifdef USE_DIFFUSE_ROUGHNESS
	uniform float diffuseRoughness;
	#ifdef USE_DIFFUSE_ROUGHNESSMAP
		uniform sampler2D diffuseRoughnessMap;
	#endif
#endif
#ifdef USE_DISPERSION
	uniform float dispersion;
#endif
#ifdef USE_RETROREFLECTION
	uniform float retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
	uniform float iridescence;
	uniform float iridescenceIOR;
	uniform float iridescenceThicknessMinimum;
	uniform float iridescenceThicknessMaximum;
#endif
#ifdef USE_SHEEN
	uniform vec3 sheenColor;
	uniform float sheenRoughness;
	#ifdef USE_SHEEN_COLORMAP
		uniform sampler2D sheenColorMap;
	#endif
	#ifdef USE_SHEEN_ROUGHNESSMAP
		uniform sampler2D sheenRoughnessMap;
	#endif
#endif
#ifdef USE_ANISOTROPY
	uniform vec2 anisotropyVector;
	#ifdef USE_ANISOTROPYMAP
		uniform sampler2D anisotropyMap;
	#endif
#endif
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <iridescence_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_physical_pars_fragment>
#include <transmission_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <clearcoat_pars_fragment>
#include <iridescence_pars_fragment>
#include <roughnessmap_pars_fragment>
#include <metalnessmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <roughnessmap_fragment>
	#include <metalnessmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <clearcoat_normal_fragment_begin>
	#include <clearcoat_normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_physical_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 totalDiffuse = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse;
	vec3 totalSpecular = reflectedLight.directSpecular + reflectedLight.indirectSpecular;
	#include <transmission_fragment>
	vec3 outgoingLight = totalDiffuse + totalSpecular + totalEmissiveRadiance;
	#ifdef USE_SHEEN
 
		outgoingLight = outgoingLight + sheenSpecularDirect + sheenSpecularIndirect;
 
 	#endif
	#ifdef USE_CLEARCOAT
		float dotNVcc = saturate( dot( geometryClearcoatNormal, geometryViewDir ) );
		vec3 Fcc = F_Schlick( material.clearcoatF0, material.clearcoatF90, dotNVcc );
		outgoingLight = outgoingLight * ( 1.0 - material.clearcoat * Fcc ) + ( clearcoatSpecularDirect + clearcoatSpecularIndirect ) * material.clearcoat;
	#endif
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,bS=`#define TOON
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,SS=`#define TOON
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <gradientmap_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_toon_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_toon_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + totalEmissiveRadiance;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,MS=`uniform float size;
uniform float scale;
#include <common>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
#ifdef USE_POINTS_UV
	varying vec2 vUv;
	uniform mat3 uvTransform;
#endif
void main() {
	#ifdef USE_POINTS_UV
		vUv = ( uvTransform * vec3( uv, 1 ) ).xy;
	#endif
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <project_vertex>
	gl_PointSize = size;
	#ifdef USE_SIZEATTENUATION
		bool isPerspective = isPerspectiveMatrix( projectionMatrix );
		if ( isPerspective ) gl_PointSize *= ( scale / - mvPosition.z );
	#endif
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <worldpos_vertex>
	#include <fog_vertex>
}`,wS=`uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <color_pars_fragment>
#include <map_particle_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_particle_fragment>
	#include <color_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,TS=`#include <common>
#include <batching_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <shadowmap_pars_vertex>
void main() {
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,ES=`uniform vec3 color;
uniform float opacity;
#include <common>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <logdepthbuf_pars_fragment>
#include <shadowmap_pars_fragment>
#include <shadowmask_pars_fragment>
void main() {
	#include <logdepthbuf_fragment>
	gl_FragColor = vec4( color, opacity * ( 1.0 - getShadowMask() ) );
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,AS=`uniform float rotation;
uniform vec2 center;
#include <common>
#include <uv_pars_vertex>
#include <fog_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	vec4 mvPosition = modelViewMatrix[ 3 ];
	vec2 scale = vec2( length( modelMatrix[ 0 ].xyz ), length( modelMatrix[ 1 ].xyz ) );
	#ifndef USE_SIZEATTENUATION
		bool isPerspective = isPerspectiveMatrix( projectionMatrix );
		if ( isPerspective ) scale *= - mvPosition.z;
	#endif
	vec2 alignedPosition = ( position.xy - ( center - vec2( 0.5 ) ) ) * scale;
	vec2 rotatedPosition;
	rotatedPosition.x = cos( rotation ) * alignedPosition.x - sin( rotation ) * alignedPosition.y;
	rotatedPosition.y = sin( rotation ) * alignedPosition.x + cos( rotation ) * alignedPosition.y;
	mvPosition.xy += rotatedPosition;
	gl_Position = projectionMatrix * mvPosition;
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
}`,CS=`uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
}`,ht={alphahash_fragment:Jv,alphahash_pars_fragment:Kv,alphamap_fragment:jv,alphamap_pars_fragment:Qv,alphatest_fragment:ey,alphatest_pars_fragment:ty,aomap_fragment:ny,aomap_pars_fragment:iy,batching_pars_vertex:sy,batching_vertex:ry,begin_vertex:oy,beginnormal_vertex:ay,bsdfs:ly,iridescence_fragment:cy,bumpmap_pars_fragment:uy,clipping_planes_fragment:hy,clipping_planes_pars_fragment:dy,clipping_planes_pars_vertex:fy,clipping_planes_vertex:py,color_fragment:my,color_pars_fragment:gy,color_pars_vertex:_y,color_vertex:xy,common:vy,defaultnormal_vertex:yy,displacementmap_pars_vertex:by,displacementmap_vertex:Sy,emissivemap_fragment:My,emissivemap_pars_fragment:wy,colorspace_fragment:Ty,colorspace_pars_fragment:Ey,envmap_fragment:Ay,envmap_common_pars_fragment:Cy,envmap_pars_fragment:Ry,envmap_pars_vertex:Py,envmap_physical_pars_fragment:Vy,envmap_vertex:Iy,fog_vertex:Ly,fog_pars_vertex:Dy,fog_fragment:Ny,fog_pars_fragment:Uy,gradientmap_pars_fragment:Oy,lightmap_pars_fragment:Fy,lights_lambert_fragment:ky,lights_lambert_pars_fragment:By,lights_pars_begin:zy,lights_toon_fragment:Gy,lights_toon_pars_fragment:Hy,lights_phong_fragment:Wy,lights_phong_pars_fragment:Xy,lights_physical_fragment:qy,lights_physical_pars_fragment:Yy,lights_fragment_begin:$y,lights_fragment_maps:Zy,lights_fragment_end:Jy,lightprobes_pars_fragment:Ky,logdepthbuf_fragment:jy,logdepthbuf_pars_fragment:Qy,logdepthbuf_pars_vertex:eb,logdepthbuf_vertex:tb,map_fragment:nb,map_pars_fragment:ib,map_particle_fragment:sb,map_particle_pars_fragment:rb,metalnessmap_fragment:ob,metalnessmap_pars_fragment:ab,morphinstance_vertex:lb,morphcolor_vertex:cb,morphnormal_vertex:ub,morphtarget_pars_vertex:hb,morphtarget_vertex:db,normal_fragment_begin:fb,normal_fragment_maps:pb,normal_pars_fragment:mb,normal_pars_vertex:gb,normal_vertex:_b,normalmap_pars_fragment:xb,clearcoat_normal_fragment_begin:vb,clearcoat_normal_fragment_maps:yb,clearcoat_pars_fragment:bb,iridescence_pars_fragment:Sb,opaque_fragment:Mb,packing:wb,premultiplied_alpha_fragment:Tb,project_vertex:Eb,dithering_fragment:Ab,dithering_pars_fragment:Cb,roughnessmap_fragment:Rb,roughnessmap_pars_fragment:Pb,shadowmap_pars_fragment:Ib,shadowmap_pars_vertex:Lb,shadowmap_vertex:Db,shadowmask_pars_fragment:Nb,skinbase_vertex:Ub,skinning_pars_vertex:Ob,skinning_vertex:Fb,skinnormal_vertex:kb,specularmap_fragment:Bb,specularmap_pars_fragment:zb,tonemapping_fragment:Vb,tonemapping_pars_fragment:Gb,transmission_fragment:Hb,transmission_pars_fragment:Wb,uv_pars_fragment:Xb,uv_pars_vertex:qb,uv_vertex:Yb,worldpos_vertex:$b,background_vert:Zb,background_frag:Jb,backgroundCube_vert:Kb,backgroundCube_frag:jb,cube_vert:Qb,cube_frag:eS,depth_vert:tS,depth_frag:nS,distance_vert:iS,distance_frag:sS,equirect_vert:rS,equirect_frag:oS,linedashed_vert:aS,linedashed_frag:lS,meshbasic_vert:cS,meshbasic_frag:uS,meshlambert_vert:hS,meshlambert_frag:dS,meshmatcap_vert:fS,meshmatcap_frag:pS,meshnormal_vert:mS,meshnormal_frag:gS,meshphong_vert:_S,meshphong_frag:xS,meshphysical_vert:vS,meshphysical_frag:yS,meshtoon_vert:bS,meshtoon_frag:SS,points_vert:MS,points_frag:wS,shadow_vert:TS,shadow_frag:ES,sprite_vert:AS,sprite_frag:CS},Le={common:{diffuse:{value:new tt(16777215)},opacity:{value:1},map:{value:null},mapTransform:{value:new nt},alphaMap:{value:null},alphaMapTransform:{value:new nt},alphaTest:{value:0}},specularmap:{specularMap:{value:null},specularMapTransform:{value:new nt}},envmap:{envMap:{value:null},envMapRotation:{value:new nt},reflectivity:{value:1},ior:{value:1.5},refractionRatio:{value:.98},dfgLUT:{value:null}},aomap:{aoMap:{value:null},aoMapIntensity:{value:1},aoMapTransform:{value:new nt}},lightmap:{lightMap:{value:null},lightMapIntensity:{value:1},lightMapTransform:{value:new nt}},bumpmap:{bumpMap:{value:null},bumpMapTransform:{value:new nt},bumpScale:{value:1}},normalmap:{normalMap:{value:null},normalMapTransform:{value:new nt},normalScale:{value:new qe(1,1)}},displacementmap:{displacementMap:{value:null},displacementMapTransform:{value:new nt},displacementScale:{value:1},displacementBias:{value:0}},emissivemap:{emissiveMap:{value:null},emissiveMapTransform:{value:new nt}},metalnessmap:{metalnessMap:{value:null},metalnessMapTransform:{value:new nt}},roughnessmap:{roughnessMap:{value:null},roughnessMapTransform:{value:new nt}},gradientmap:{gradientMap:{value:null}},fog:{fogDensity:{value:25e-5},fogNear:{value:1},fogFar:{value:2e3},fogColor:{value:new tt(16777215)}},lights:{ambientLightColor:{value:[]},lightProbe:{value:[]},sunLights:{value:[],properties:{direction:{},color:{}}},sunLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},sunShadowMatrix:{value:[]},sunShadowCascade:{value:[]},directionalLights:{value:[],properties:{direction:{},color:{}}},directionalLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},directionalShadowMatrix:{value:[]},spotLights:{value:[],properties:{color:{},position:{},direction:{},distance:{},coneCos:{},penumbraCos:{},decay:{}}},spotLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},spotLightMap:{value:[]},spotLightMatrix:{value:[]},pointLights:{value:[],properties:{color:{},position:{},decay:{},distance:{}}},pointLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{},shadowCameraNear:{},shadowCameraFar:{}}},pointShadowMatrix:{value:[]},hemisphereLights:{value:[],properties:{direction:{},skyColor:{},groundColor:{}}},rectAreaLights:{value:[],properties:{color:{},position:{},width:{},height:{}}},ltc_1:{value:null},ltc_2:{value:null},probesSH:{value:[]},probesMin:{value:[]},probesMax:{value:[]},probesResolution:{value:[]}},points:{diffuse:{value:new tt(16777215)},opacity:{value:1},size:{value:1},scale:{value:1},map:{value:null},alphaMap:{value:null},alphaMapTransform:{value:new nt},alphaTest:{value:0},uvTransform:{value:new nt}},sprite:{diffuse:{value:new tt(16777215)},opacity:{value:1},center:{value:new qe(.5,.5)},rotation:{value:0},map:{value:null},mapTransform:{value:new nt},alphaMap:{value:null},alphaMapTransform:{value:new nt},alphaTest:{value:0}}},rs={basic:{uniforms:Wn([Le.common,Le.specularmap,Le.envmap,Le.aomap,Le.lightmap,Le.fog]),vertexShader:ht.meshbasic_vert,fragmentShader:ht.meshbasic_frag},lambert:{uniforms:Wn([Le.common,Le.specularmap,Le.envmap,Le.aomap,Le.lightmap,Le.emissivemap,Le.bumpmap,Le.normalmap,Le.displacementmap,Le.fog,Le.lights,{emissive:{value:new tt(0)},envMapIntensity:{value:1}}]),vertexShader:ht.meshlambert_vert,fragmentShader:ht.meshlambert_frag},phong:{uniforms:Wn([Le.common,Le.specularmap,Le.envmap,Le.aomap,Le.lightmap,Le.emissivemap,Le.bumpmap,Le.normalmap,Le.displacementmap,Le.fog,Le.lights,{emissive:{value:new tt(0)},specular:{value:new tt(1118481)},shininess:{value:30},envMapIntensity:{value:1}}]),vertexShader:ht.meshphong_vert,fragmentShader:ht.meshphong_frag},standard:{uniforms:Wn([Le.common,Le.envmap,Le.aomap,Le.lightmap,Le.emissivemap,Le.bumpmap,Le.normalmap,Le.displacementmap,Le.roughnessmap,Le.metalnessmap,Le.fog,Le.lights,{emissive:{value:new tt(0)},roughness:{value:1},metalness:{value:0},envMapIntensity:{value:1}}]),vertexShader:ht.meshphysical_vert,fragmentShader:ht.meshphysical_frag},toon:{uniforms:Wn([Le.common,Le.aomap,Le.lightmap,Le.emissivemap,Le.bumpmap,Le.normalmap,Le.displacementmap,Le.gradientmap,Le.fog,Le.lights,{emissive:{value:new tt(0)}}]),vertexShader:ht.meshtoon_vert,fragmentShader:ht.meshtoon_frag},matcap:{uniforms:Wn([Le.common,Le.bumpmap,Le.normalmap,Le.displacementmap,Le.fog,{matcap:{value:null}}]),vertexShader:ht.meshmatcap_vert,fragmentShader:ht.meshmatcap_frag},points:{uniforms:Wn([Le.points,Le.fog]),vertexShader:ht.points_vert,fragmentShader:ht.points_frag},dashed:{uniforms:Wn([Le.common,Le.fog,{scale:{value:1},dashSize:{value:1},totalSize:{value:2}}]),vertexShader:ht.linedashed_vert,fragmentShader:ht.linedashed_frag},depth:{uniforms:Wn([Le.common,Le.displacementmap]),vertexShader:ht.depth_vert,fragmentShader:ht.depth_frag},normal:{uniforms:Wn([Le.common,Le.bumpmap,Le.normalmap,Le.displacementmap,{opacity:{value:1}}]),vertexShader:ht.meshnormal_vert,fragmentShader:ht.meshnormal_frag},sprite:{uniforms:Wn([Le.sprite,Le.fog]),vertexShader:ht.sprite_vert,fragmentShader:ht.sprite_frag},background:{uniforms:{uvTransform:{value:new nt},t2D:{value:null},backgroundIntensity:{value:1}},vertexShader:ht.background_vert,fragmentShader:ht.background_frag},backgroundCube:{uniforms:{envMap:{value:null},backgroundBlurriness:{value:0},backgroundIntensity:{value:1},backgroundRotation:{value:new nt}},vertexShader:ht.backgroundCube_vert,fragmentShader:ht.backgroundCube_frag},cube:{uniforms:{tCube:{value:null},tFlip:{value:-1},opacity:{value:1}},vertexShader:ht.cube_vert,fragmentShader:ht.cube_frag},equirect:{uniforms:{tEquirect:{value:null}},vertexShader:ht.equirect_vert,fragmentShader:ht.equirect_frag},distance:{uniforms:Wn([Le.common,Le.displacementmap,{referencePosition:{value:new H},nearDistance:{value:1},farDistance:{value:1e3}}]),vertexShader:ht.distance_vert,fragmentShader:ht.distance_frag},shadow:{uniforms:Wn([Le.lights,Le.fog,{color:{value:new tt(0)},opacity:{value:1}}]),vertexShader:ht.shadow_vert,fragmentShader:ht.shadow_frag}};rs.physical={uniforms:Wn([rs.standard.uniforms,{clearcoat:{value:0},clearcoatMap:{value:null},clearcoatMapTransform:{value:new nt},clearcoatNormalMap:{value:null},clearcoatNormalMapTransform:{value:new nt},clearcoatNormalScale:{value:new qe(1,1)},clearcoatRoughness:{value:0},clearcoatRoughnessMap:{value:null},clearcoatRoughnessMapTransform:{value:new nt},diffuseRoughness:{value:0},diffuseRoughnessMap:{value:null},diffuseRoughnessMapTransform:{value:new nt},dispersion:{value:0},retroreflectivity:{value:0},iridescence:{value:0},iridescenceMap:{value:null},iridescenceMapTransform:{value:new nt},iridescenceIOR:{value:1.3},iridescenceThicknessMinimum:{value:100},iridescenceThicknessMaximum:{value:400},iridescenceThicknessMap:{value:null},iridescenceThicknessMapTransform:{value:new nt},sheen:{value:0},sheenColor:{value:new tt(0)},sheenColorMap:{value:null},sheenColorMapTransform:{value:new nt},sheenRoughness:{value:1},sheenRoughnessMap:{value:null},sheenRoughnessMapTransform:{value:new nt},transmission:{value:0},transmissionMap:{value:null},transmissionMapTransform:{value:new nt},transmissionSamplerSize:{value:new qe},transmissionSamplerMap:{value:null},thickness:{value:0},thicknessMap:{value:null},thicknessMapTransform:{value:new nt},attenuationDistance:{value:0},attenuationColor:{value:new tt(0)},specularColor:{value:new tt(1,1,1)},specularColorMap:{value:null},specularColorMapTransform:{value:new nt},specularIntensity:{value:1},specularIntensityMap:{value:null},specularIntensityMapTransform:{value:new nt},anisotropyVector:{value:new qe},anisotropyMap:{value:null},anisotropyMapTransform:{value:new nt}}]),vertexShader:ht.meshphysical_vert,fragmentShader:ht.meshphysical_frag};var xu={r:0,b:0,g:0},RS=new Bt,Gg=new nt;Gg.set(-1,0,0,0,1,0,0,0,1);function PS(n,e,t,i,s,r){let o=new tt(0),a=s===!0?0:1,l,c,u=null,d=0,h=null;function f(b){let C=b.isScene===!0?b.background:null;if(C&&C.isTexture){let S=b.backgroundBlurriness>0;C=e.get(C,S)}return C}function m(b){let C=!1,S=f(b);S===null?g(o,a):S&&S.isColor&&(g(S,1),C=!0);let P=n.xr.getEnvironmentBlendMode();P==="additive"?t.buffers.color.setClear(0,0,0,1,r):P==="alpha-blend"&&t.buffers.color.setClear(0,0,0,0,r),(n.autoClear||C)&&(t.buffers.depth.setTest(!0),t.buffers.depth.setMask(!0),t.buffers.color.setMask(!0),n.clear(n.autoClearColor,n.autoClearDepth,n.autoClearStencil))}function y(b,C){let S=f(C);S&&S.isCubeTexture?(c===void 0&&(c=new ri(new Ts(1,1,1),new ts({name:"BackgroundCubeMaterial",uniforms:xr(rs.backgroundCube.uniforms),vertexShader:rs.backgroundCube.vertexShader,fragmentShader:rs.backgroundCube.fragmentShader,side:ti,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),c.geometry.deleteAttribute("normal"),c.geometry.deleteAttribute("uv"),c.onBeforeRender=function(P,A,x){this.matrixWorld.copyPosition(x.matrixWorld)},Object.defineProperty(c.material,"envMap",{get:function(){return this.uniforms.envMap.value}}),i.update(c)),c.material.uniforms.envMap.value=S,c.material.uniforms.backgroundBlurriness.value=C.backgroundBlurriness,c.material.uniforms.backgroundIntensity.value=C.backgroundIntensity,c.material.uniforms.backgroundRotation.value.setFromMatrix4(RS.makeRotationFromEuler(C.backgroundRotation)).transpose(),S.isRenderTargetTexture===!1&&c.material.uniforms.backgroundRotation.value.premultiply(Gg),c.material.toneMapped=yt.getTransfer(S.colorSpace)!==Rt,(u!==S||d!==S.version||h!==n.toneMapping)&&(c.material.needsUpdate=!0,u=S,d=S.version,h=n.toneMapping),c.layers.enableAll(),b.unshift(c,c.geometry,c.material,0,0,null)):S&&S.isTexture&&(l===void 0&&(l=new ri(new Ea(2,2),new ts({name:"BackgroundMaterial",uniforms:xr(rs.background.uniforms),vertexShader:rs.background.vertexShader,fragmentShader:rs.background.fragmentShader,side:Qs,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),l.geometry.deleteAttribute("normal"),Object.defineProperty(l.material,"map",{get:function(){return this.uniforms.t2D.value}}),i.update(l)),l.material.uniforms.t2D.value=S,l.material.uniforms.backgroundIntensity.value=C.backgroundIntensity,l.material.toneMapped=yt.getTransfer(S.colorSpace)!==Rt,S.matrixAutoUpdate===!0&&S.updateMatrix(),l.material.uniforms.uvTransform.value.copy(S.matrix),(u!==S||d!==S.version||h!==n.toneMapping)&&(l.material.needsUpdate=!0,u=S,d=S.version,h=n.toneMapping),l.layers.enableAll(),b.unshift(l,l.geometry,l.material,0,0,null))}function g(b,C){b.getRGB(xu,Hd(n)),t.buffers.color.setClear(xu.r,xu.g,xu.b,C,r)}function _(){c!==void 0&&(c.geometry.dispose(),c.material.dispose(),c=void 0),l!==void 0&&(l.geometry.dispose(),l.material.dispose(),l=void 0)}return{getClearColor:function(){return o},setClearColor:function(b,C=1){o.set(b),a=C,g(o,a)},getClearAlpha:function(){return a},setClearAlpha:function(b){a=b,g(o,a)},render:m,addToRenderList:y,dispose:_}}function IS(n,e){let t=n.getParameter(n.MAX_VERTEX_ATTRIBS),i={},s=h(null),r=s,o=!1;function a(L,B,V,U,X){let $=!1,W=d(L,U,V,B);r!==W&&(r=W,c(r.object)),$=f(L,U,V,X),$&&m(L,U,V,X),X!==null&&e.update(X,n.ELEMENT_ARRAY_BUFFER),($||o)&&(o=!1,S(L,B,V,U),X!==null&&n.bindBuffer(n.ELEMENT_ARRAY_BUFFER,e.get(X).buffer))}function l(){return n.createVertexArray()}function c(L){return n.bindVertexArray(L)}function u(L){return n.deleteVertexArray(L)}function d(L,B,V,U){let X=U.wireframe===!0,$=i[B.id];$===void 0&&($={},i[B.id]=$);let W=L.isInstancedMesh===!0?L.id:0,ce=$[W];ce===void 0&&(ce={},$[W]=ce);let K=ce[V.id];K===void 0&&(K={},ce[V.id]=K);let Q=K[X];return Q===void 0&&(Q=h(l()),K[X]=Q),Q}function h(L){let B=[],V=[],U=[];for(let X=0;X<t;X++)B[X]=0,V[X]=0,U[X]=0;return{geometry:null,program:null,wireframe:!1,newAttributes:B,enabledAttributes:V,attributeDivisors:U,object:L,attributes:{},index:null}}function f(L,B,V,U){let X=r.attributes,$=B.attributes,W=0,ce=V.getAttributes();for(let K in ce)if(ce[K].location>=0){let se=X[K],de=$[K];if(de===void 0&&(K==="instanceMatrix"&&L.instanceMatrix&&(de=L.instanceMatrix),K==="instanceColor"&&L.instanceColor&&(de=L.instanceColor)),se===void 0||se.attribute!==de||de&&se.data!==de.data)return!0;W++}return r.attributesNum!==W||r.index!==U}function m(L,B,V,U){let X={},$=B.attributes,W=0,ce=V.getAttributes();for(let K in ce)if(ce[K].location>=0){let se=$[K];se===void 0&&(K==="instanceMatrix"&&L.instanceMatrix&&(se=L.instanceMatrix),K==="instanceColor"&&L.instanceColor&&(se=L.instanceColor));let de={};de.attribute=se,se&&se.data&&(de.data=se.data),X[K]=de,W++}r.attributes=X,r.attributesNum=W,r.index=U}function y(){let L=r.newAttributes;for(let B=0,V=L.length;B<V;B++)L[B]=0}function g(L){_(L,0)}function _(L,B){let V=r.newAttributes,U=r.enabledAttributes,X=r.attributeDivisors;V[L]=1,U[L]===0&&(n.enableVertexAttribArray(L),U[L]=1),X[L]!==B&&(n.vertexAttribDivisor(L,B),X[L]=B)}function b(){let L=r.newAttributes,B=r.enabledAttributes;for(let V=0,U=B.length;V<U;V++)B[V]!==L[V]&&(n.disableVertexAttribArray(V),B[V]=0)}function C(L,B,V,U,X,$,W){W===!0?n.vertexAttribIPointer(L,B,V,X,$):n.vertexAttribPointer(L,B,V,U,X,$)}function S(L,B,V,U){y();let X=U.attributes,$=V.getAttributes(),W=B.defaultAttributeValues;for(let ce in $){let K=$[ce];if(K.location>=0){let Q=X[ce];if(Q===void 0&&(ce==="instanceMatrix"&&L.instanceMatrix&&(Q=L.instanceMatrix),ce==="instanceColor"&&L.instanceColor&&(Q=L.instanceColor)),Q!==void 0){let se=Q.normalized,de=Q.itemSize,he=e.get(Q);if(he===void 0)continue;let ee=he.buffer,me=he.type,xe=he.bytesPerElement,Ae=me===n.INT||me===n.UNSIGNED_INT||Q.gpuType===Nc;if(Q.isInterleavedBufferAttribute){let Se=Q.data,We=Se.isInterleavedBuffer===!0?Se.stride:Se.itemSize,ot=Q.offset;if(Se.isInstancedInterleavedBuffer||Se.isInstancedBufferAttribute){for(let Ge=0;Ge<K.locationSize;Ge++)_(K.location+Ge,Se.meshPerAttribute);L.isInstancedMesh!==!0&&U._maxInstanceCount===void 0&&(U._maxInstanceCount=Se.meshPerAttribute*Se.count)}else for(let Ge=0;Ge<K.locationSize;Ge++)g(K.location+Ge);n.bindBuffer(n.ARRAY_BUFFER,ee);for(let Ge=0;Ge<K.locationSize;Ge++)C(K.location+Ge,de/K.locationSize,me,se,We*xe,(ot+de/K.locationSize*Ge)*xe,Ae)}else{if(Q.isInstancedBufferAttribute){for(let Se=0;Se<K.locationSize;Se++)_(K.location+Se,Q.meshPerAttribute);L.isInstancedMesh!==!0&&U._maxInstanceCount===void 0&&(U._maxInstanceCount=Q.meshPerAttribute*Q.count)}else for(let Se=0;Se<K.locationSize;Se++)g(K.location+Se);n.bindBuffer(n.ARRAY_BUFFER,ee);for(let Se=0;Se<K.locationSize;Se++)C(K.location+Se,de/K.locationSize,me,se,de*xe,de/K.locationSize*Se*xe,Ae)}}else if(W!==void 0){let se=W[ce];if(se!==void 0)switch(se.length){case 2:n.vertexAttrib2fv(K.location,se);break;case 3:n.vertexAttrib3fv(K.location,se);break;case 4:n.vertexAttrib4fv(K.location,se);break;default:n.vertexAttrib1fv(K.location,se)}}}}b()}function P(){F();for(let L in i){let B=i[L];for(let V in B){let U=B[V];for(let X in U){let $=U[X];for(let W in $)u($[W].object),delete $[W];delete U[X]}}delete i[L]}}function A(L){if(i[L.id]===void 0)return;let B=i[L.id];for(let V in B){let U=B[V];for(let X in U){let $=U[X];for(let W in $)u($[W].object),delete $[W];delete U[X]}}delete i[L.id]}function x(L){for(let B in i){let V=i[B];for(let U in V){let X=V[U];if(X[L.id]===void 0)continue;let $=X[L.id];for(let W in $)u($[W].object),delete $[W];delete X[L.id]}}}function w(L){for(let B in i){let V=i[B],U=L.isInstancedMesh===!0?L.id:0,X=V[U];if(X!==void 0){for(let $ in X){let W=X[$];for(let ce in W)u(W[ce].object),delete W[ce];delete X[$]}delete V[U],Object.keys(V).length===0&&delete i[B]}}}function F(){D(),o=!0,r!==s&&(r=s,c(r.object))}function D(){s.geometry=null,s.program=null,s.wireframe=!1}return{setup:a,reset:F,resetDefaultState:D,dispose:P,releaseStatesOfGeometry:A,releaseStatesOfObject:w,releaseStatesOfProgram:x,initAttributes:y,enableAttribute:g,disableUnusedAttributes:b}}function LS(n,e,t){let i;function s(l){i=l}function r(l,c){n.drawArrays(i,l,c),t.update(c,i,1)}function o(l,c,u){u!==0&&(n.drawArraysInstanced(i,l,c,u),t.update(c,i,u))}function a(l,c,u){if(u===0)return;e.get("WEBGL_multi_draw").multiDrawArraysWEBGL(i,l,0,c,0,u);let h=0;for(let f=0;f<u;f++)h+=c[f];t.update(h,i,1)}this.setMode=s,this.render=r,this.renderInstances=o,this.renderMultiDraw=a}function DS(n,e,t,i){let s;function r(){if(s!==void 0)return s;if(e.has("EXT_texture_filter_anisotropic")===!0){let x=e.get("EXT_texture_filter_anisotropic");s=n.getParameter(x.MAX_TEXTURE_MAX_ANISOTROPY_EXT)}else s=0;return s}function o(x){return!(x!==zi&&i.convert(x)!==n.getParameter(n.IMPLEMENTATION_COLOR_READ_FORMAT))}function a(x){let w=x===Bi&&(e.has("EXT_color_buffer_half_float")||e.has("EXT_color_buffer_float"));return!(x!==oi&&x!==ki&&!w&&i.convert(x)!==n.getParameter(n.IMPLEMENTATION_COLOR_READ_TYPE))}function l(x){if(x==="highp"){if(n.getShaderPrecisionFormat(n.VERTEX_SHADER,n.HIGH_FLOAT).precision>0&&n.getShaderPrecisionFormat(n.FRAGMENT_SHADER,n.HIGH_FLOAT).precision>0)return"highp";x="mediump"}return x==="mediump"&&n.getShaderPrecisionFormat(n.VERTEX_SHADER,n.MEDIUM_FLOAT).precision>0&&n.getShaderPrecisionFormat(n.FRAGMENT_SHADER,n.MEDIUM_FLOAT).precision>0?"mediump":"lowp"}let c=t.precision!==void 0?t.precision:"highp",u=l(c);u!==c&&($e("WebGLRenderer:",c,"not supported, using",u,"instead."),c=u);let d=t.reversedDepthBuffer===!0&&e.has("EXT_clip_control"),h=t.logarithmicDepthBuffer===!0&&d===!1;t.reversedDepthBuffer===!0&&d===!1&&$e("WebGLRenderer: Unable to use reversed depth buffer due to missing EXT_clip_control extension. Fallback to default depth buffer."),t.logarithmicDepthBuffer===!0&&d===!0&&$e("WebGLRenderer: Logarithmic depth buffer is ignored when reversed depth buffer is enabled.");let f=n.getParameter(n.MAX_TEXTURE_IMAGE_UNITS),m=n.getParameter(n.MAX_VERTEX_TEXTURE_IMAGE_UNITS),y=n.getParameter(n.MAX_TEXTURE_SIZE),g=n.getParameter(n.MAX_CUBE_MAP_TEXTURE_SIZE),_=n.getParameter(n.MAX_VERTEX_ATTRIBS),b=n.getParameter(n.MAX_VERTEX_UNIFORM_VECTORS),C=n.getParameter(n.MAX_VARYING_VECTORS),S=n.getParameter(n.MAX_FRAGMENT_UNIFORM_VECTORS),P=n.getParameter(n.MAX_SAMPLES),A=n.getParameter(n.SAMPLES);return{isWebGL2:!0,getMaxAnisotropy:r,getMaxPrecision:l,textureFormatReadable:o,textureTypeReadable:a,precision:c,logarithmicDepthBuffer:h,reversedDepthBuffer:d,maxTextures:f,maxVertexTextures:m,maxTextureSize:y,maxCubemapSize:g,maxAttributes:_,maxVertexUniforms:b,maxVaryings:C,maxFragmentUniforms:S,maxSamples:P,samples:A}}function NS(n){let e=this,t=null,i=0,s=!1,r=!1,o=new pi,a=new nt,l={value:null,needsUpdate:!1};this.uniform=l,this.numPlanes=0,this.numIntersection=0,this.init=function(d,h){let f=d.length!==0||h||i!==0||s;return s=h,i=d.length,f},this.beginShadows=function(){r=!0,u(null)},this.endShadows=function(){r=!1},this.setGlobalState=function(d,h){t=u(d,h,0)},this.setState=function(d,h,f){let m=d.clippingPlanes,y=d.clipIntersection,g=d.clipShadows,_=n.get(d);if(!s||m===null||m.length===0||r&&!g)r?u(null):c();else{let b=r?0:i,C=b*4,S=_.clippingState||null;l.value=S,S=u(m,h,C,f);for(let P=0;P!==C;++P)S[P]=t[P];_.clippingState=S,this.numIntersection=y?this.numPlanes:0,this.numPlanes+=b}};function c(){l.value!==t&&(l.value=t,l.needsUpdate=i>0),e.numPlanes=i,e.numIntersection=0}function u(d,h,f,m){let y=d!==null?d.length:0,g=null;if(y!==0){if(g=l.value,m!==!0||g===null){let _=f+y*4,b=h.matrixWorldInverse;a.getNormalMatrix(b),(g===null||g.length<_)&&(g=new Float32Array(_));for(let C=0,S=f;C!==y;++C,S+=4)o.copy(d[C]).applyMatrix4(b,a),o.normal.toArray(g,S),g[S+3]=o.constant}l.value=g,l.needsUpdate=!0}return e.numPlanes=y,e.numIntersection=0,g}}var qa=class extends mi{constructor(e=1,t={}){super(e,e,t),this.isWebGLCubeRenderTarget=!0;let i={width:e,height:e,depth:1},s=[i,i,i,i,i,i];this.texture=new ya(s),this._setTextureOptions(t),this.texture.isRenderTargetTexture=!0}fromEquirectangularTexture(e,t){this.texture.type=t.type,this.texture.colorSpace=t.colorSpace,this.texture.generateMipmaps=t.generateMipmaps,this.texture.minFilter=t.minFilter,this.texture.magFilter=t.magFilter;let i={uniforms:{tEquirect:{value:null}},vertexShader:`

				varying vec3 vWorldDirection;

				vec3 transformDirection( in vec3 dir, in mat4 matrix ) {

					return normalize( ( matrix * vec4( dir, 0.0 ) ).xyz );

				}

				void main() {

					vWorldDirection = transformDirection( position, modelMatrix );

					#include <begin_vertex>
					#include <project_vertex>

				}
			`,fragmentShader:`

				uniform sampler2D tEquirect;

				varying vec3 vWorldDirection;

				#include <common>

				void main() {

					vec3 direction = normalize( vWorldDirection );

					vec2 sampleUV = equirectUv( direction );

					gl_FragColor = texture2D( tEquirect, sampleUV );

				}
			`},s=new Ts(5,5,5),r=new ts({name:"CubemapFromEquirect",uniforms:xr(i.uniforms),vertexShader:i.vertexShader,fragmentShader:i.fragmentShader,side:ti,blending:pr});r.uniforms.tEquirect.value=t;let o=new ri(s,r),a=t.minFilter;return t.minFilter===Es&&(t.minFilter=Qn),new po(1,10,this).update(e,o),t.minFilter=a,o.geometry.dispose(),o.material.dispose(),this}clear(e,t=!0,i=!0,s=!0){let r=e.getRenderTarget();for(let o=0;o<6;o++)e.setRenderTarget(this,o),e.clear(t,i,s);e.setRenderTarget(r)}},yg=256,US=3,OS=20,Hg=256,Wg=16,FS=3,kS=new H,BS=new tt,yu=class n{constructor(e){this._renderer=e,this._cubeSize=0,this._sourceTarget=null,this._cubeCamera=new po(1,10,null),this._boxMesh=new ri(new Ts(5,5,5),null),this._cubemapMaterial=null,this._equirectMaterial=null,this._blurMaterial=null,this._ggxMaterial=null,this._integrationMaterial=null}fromScene(e,t=0,i=.1,s=100,r={}){let{size:o=256,position:a=kS}=r,l=this._renderer;this._setSize(o);let c=this._allocateTarget(),u=this._getSourceTarget(!0);t>0&&(u.texture.mipmapsAutoUpdate=!1);let d=l.autoClear,h=l.autoClearColor,f=l.autoClearDepth,m=l.autoClearStencil,y=e.background;l.autoClear=!0,l.autoClearColor=!0,l.autoClearDepth=!0,l.autoClearStencil=!0,y===null&&(e.background=l.getClearColor(BS));let g=new po(i,s,u);return g.position.copy(a),g.update(l,e),l.autoClear=d,l.autoClearColor=h,l.autoClearDepth=f,l.autoClearStencil=m,e.background=y,t>0&&(u.texture.mipmapsAutoUpdate=!0,this._blur(c,t)),this._applyPMREM(c),c}fromEquirectangular(e,t=null){return this._fromTexture(e,t)}fromCubemap(e,t=null){return this._fromTexture(e,t)}compileCubemapShader(){this._cubemapMaterial===null&&(this._cubemapMaterial=Mg(),this._compileMaterial(this._cubemapMaterial))}compileEquirectangularShader(){this._equirectMaterial===null&&(this._equirectMaterial=Sg(),this._compileMaterial(this._equirectMaterial))}dispose(){this._sourceTarget!==null&&this._sourceTarget.dispose(),this._cubemapMaterial!==null&&this._cubemapMaterial.dispose(),this._equirectMaterial!==null&&this._equirectMaterial.dispose(),this._blurMaterial!==null&&this._blurMaterial.dispose(),this._ggxMaterial!==null&&this._ggxMaterial.dispose(),this._integrationMaterial!==null&&this._integrationMaterial.dispose(),this._boxMesh.geometry.dispose()}static lodToRoughness(e,t){return t>0?1-Math.sqrt(1-e/t):0}_setSize(e){this._cubeSize=Math.max(yg,Bd(e))}_fromTexture(e,t){e.mapping===gr||e.mapping===vo?this._setSize(e.image.length===0?yg:e.image[0].width||e.image[0].image.width):this._setSize(e.image.width/4);let i=t||this._allocateTarget();return this._textureToCubemap(e),this._applyPMREM(i),i}_allocateTarget(){let e=this._cubeSize,t=bg(e,!1,!1),i=Math.log2(e)-US;for(let s=0;s<=i;s++)t.texture.mipmaps.push({width:e>>s,height:e>>s});return t.texture.name="PMREM",t.texture.isPMREMTexture=!0,t}_getSourceTarget(e=!1){let t=this._cubeSize,i=this._sourceTarget;return(i===null||i.width!==t||e&&i.depthBuffer===!1)&&(i!==null&&i.dispose(),this._sourceTarget=bg(t,!0,e)),this._sourceTarget}_compileMaterial(e){this._boxMesh.material=e,this._renderer.compile(this._boxMesh,this._cubeCamera.children[0])}_renderCube(e,t,i){let s=this._boxMesh,r=this._cubeCamera;s.material=i,r.renderTarget=e,r.activeMipmapLevel=t;let o=e.width>>t;e.viewport.set(0,0,o,o),r.update(this._renderer,s),e.viewport.set(0,0,e.width,e.height)}_textureToCubemap(e){let t;e.mapping===gr||e.mapping===vo?(this._cubemapMaterial===null&&(this._cubemapMaterial=Mg()),t=this._cubemapMaterial,t.uniforms.flipEnvMap.value=e.isRenderTargetTexture===!1?-1:1):(this._equirectMaterial===null&&(this._equirectMaterial=Sg()),t=this._equirectMaterial),t.uniforms.envMap.value=e,this._renderCube(this._getSourceTarget(),0,t)}_applyPMREM(e){this._ggxMaterial===null&&(this._ggxMaterial=zS(),this._integrationMaterial=VS());let t=this._cubeSize,i=e.texture.mipmaps.length-1,s=this._ggxMaterial.uniforms;s.envMap.value=this._sourceTarget.texture;let r=this._integrationMaterial.uniforms;r.envMap.value=this._sourceTarget.texture,r.sourceLod.value=Math.log2(t/Wg);for(let o=0;o<=i;o++){let a=n.lodToRoughness(o,i);if(o>i-FS)r.roughness.value=a,this._renderCube(e,o,this._integrationMaterial);else{let l=a>0?Math.log2(t)+.5*Math.log2(6/(Hg*Math.pow(a,4)))+.5:0;s.roughness.value=a,s.lodBias.value=l,this._renderCube(e,o,this._ggxMaterial)}}}_blur(e,t){this._blurMaterial===null&&(this._blurMaterial=GS());let i=this._blurMaterial,s=i.uniforms,r=this._sourceTarget;s.sigma.value=Math.min(t,Math.PI)/Math.SQRT2,s.envMap.value=r.texture,this._renderCube(e,0,i),s.envMap.value=e.texture,this._renderCube(r,0,i)}};function bg(n,e,t){return new qa(n,{minFilter:Es,generateMipmaps:e,type:Bi,colorSpace:la,depthBuffer:t})}function Ya(n,e,t){return new ts({name:n,uniforms:e,vertexShader:ht.cube_vert,fragmentShader:t,side:ti,blending:pr,depthTest:!1,depthWrite:!1})}function zS(){return Ya("PMREMGGXConvolution",{envMap:{value:null},roughness:{value:0},lodBias:{value:0}},`

		#define GGX_SAMPLES ${Hg}u

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float roughness;
		uniform float lodBias;

		#include <common>

		// Van der Corput radical inverse
		float radicalInverse_VdC( uint bits ) {

			bits = ( bits << 16u ) | ( bits >> 16u );
			bits = ( ( bits & 0x55555555u ) << 1u ) | ( ( bits & 0xAAAAAAAAu ) >> 1u );
			bits = ( ( bits & 0x33333333u ) << 2u ) | ( ( bits & 0xCCCCCCCCu ) >> 2u );
			bits = ( ( bits & 0x0F0F0F0Fu ) << 4u ) | ( ( bits & 0xF0F0F0F0u ) >> 4u );
			bits = ( ( bits & 0x00FF00FFu ) << 8u ) | ( ( bits & 0xFF00FF00u ) >> 8u );
			return float( bits ) * 2.3283064365386963e-10; // / 0x100000000

		}

		// Hammersley sequence
		vec2 hammersley( uint i, uint N ) {

			return vec2( float( i ) / float( N ), radicalInverse_VdC( i ) );

		}

		void main() {

			vec3 N = normalize( vWorldDirection );

			// For very low roughness, just sample the environment directly
			if ( roughness < 0.001 ) {

				gl_FragColor = vec4( textureLod( envMap, N, 0.0 ).rgb, 1.0 );
				return;

			}

			float alpha = roughness * roughness;
			float alpha2 = alpha * alpha;

			// Tangent space basis for VNDF sampling
			vec3 up = abs( N.z ) < 0.999 ? vec3( 0.0, 0.0, 1.0 ) : vec3( 1.0, 0.0, 0.0 );
			vec3 tangent = normalize( cross( up, N ) );
			vec3 bitangent = cross( N, tangent );

			vec3 prefilteredColor = vec3( 0.0 );
			float totalWeight = 0.0;

			for ( uint i = 0u; i < GGX_SAMPLES; i ++ ) {

				vec2 Xi = hammersley( i, GGX_SAMPLES );

				// With V = N, sample the reflected direction directly.
				float invQ = 1.0 / ( 1.0 - Xi.x + alpha2 * Xi.x );
				float NdotL = ( 1.0 - Xi.x - alpha2 * Xi.x ) * invQ;

				if ( NdotL > 0.0 ) {

					float phi = 2.0 * PI * Xi.y;
					float sinTheta = 2.0 * alpha * sqrt( Xi.x * ( 1.0 - Xi.x ) ) * invQ;
					vec3 L = N * NdotL + ( tangent * cos( phi ) + bitangent * sin( phi ) ) * sinTheta;

					// Match the source mip to the sample's solid angle. The terms
					// independent of the sample are precomputed in lodBias.
					float d = alpha2 * invQ;
					float lod = max( log2( d ) + lodBias, 0.0 );

					// Weight by NdotL for the split-sum approximation
					prefilteredColor += textureLod( envMap, L, lod ).rgb * NdotL;
					totalWeight += NdotL;

				}

			}

			gl_FragColor = vec4( prefilteredColor / totalWeight, 1.0 );

		}
	`)}function VS(){return Ya("PMREMGGXIntegration",{envMap:{value:null},roughness:{value:0},sourceLod:{value:0},sourceSize:{value:Wg}},`

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float roughness;
		uniform float sourceLod;
		uniform int sourceSize;

		void main() {

			vec3 N = normalize( vWorldDirection );

			float alpha = roughness * roughness;
			float alpha2 = alpha * alpha;

			float texelSize = 2.0 / float( sourceSize );

			vec3 prefilteredColor = vec3( 0.0 );
			float totalWeight = 0.0;

			// Pair opposite texels: only the one in N's hemisphere contributes.
			for ( int face = 0; face < 3; face ++ ) {

				for ( int y = 0; y < sourceSize; y ++ ) {

					for ( int x = 0; x < sourceSize; x ++ ) {

						vec2 uv = ( vec2( x, y ) + 0.5 ) * texelSize - 1.0;
						vec3 texelDirection = face == 0 ? vec3( 1.0, uv ) : ( face == 1 ? vec3( uv.x, 1.0, uv.y ) : vec3( uv, 1.0 ) );

						float invDistance = inversesqrt( 1.0 + dot( uv, uv ) );
						float NdotL = dot( N, texelDirection );
						texelDirection *= NdotL < 0.0 ? - 1.0 : 1.0;
						NdotL = abs( NdotL ) * invDistance;

						// With V = N, NdotH squared is ( 1 + NdotL ) / 2. Common factors
						// in the GGX distribution and texel solid angle cancel when normalized.
						float d = 1.0 + alpha2 + ( alpha2 - 1.0 ) * NdotL;
						float weight = NdotL * invDistance * invDistance * invDistance / ( d * d );

						prefilteredColor += textureLod( envMap, texelDirection, sourceLod ).rgb * weight;
						totalWeight += weight;

					}

				}

			}

			gl_FragColor = vec4( prefilteredColor / totalWeight, 1.0 );

		}
	`)}function GS(){return Ya("PMREMSphericalGaussianBlur",{envMap:{value:null},sigma:{value:0}},`

		#define SAMPLES ${OS}
		#define GOLDEN_ANGLE 2.39996322973

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float sigma;

		#include <common>

		void main() {

			vec3 outputDirection = normalize( vWorldDirection );

			vec3 up = abs( outputDirection.z ) < 0.999 ? vec3( 0.0, 0.0, 1.0 ) : vec3( 1.0, 0.0, 0.0 );
			vec3 tangent = normalize( cross( up, outputDirection ) );
			vec3 bitangent = cross( outputDirection, tangent );

			// Truncate the kernel at three standard deviations or at the antipode.
			float thetaMax = min( 3.0 * sigma, PI );
			float truncation = 1.0 - exp( - 0.5 * thetaMax * thetaMax / ( sigma * sigma ) );

			vec3 accumColor = vec3( 0.0 );
			float accumWeight = 0.0;

			for ( int i = 0; i < SAMPLES; i ++ ) {

				// Stratified inverse-CDF sampling of the Gaussian, placed on a golden-angle spiral.
				float stratum = ( float( i ) + 0.5 ) / float( SAMPLES );
				float theta = sigma * sqrt( - 2.0 * log( 1.0 - stratum * truncation ) );
				float phi = float( i ) * GOLDEN_ANGLE;

				vec3 offset = cos( phi ) * tangent + sin( phi ) * bitangent;
				vec3 sampleDirection = cos( theta ) * outputDirection + sin( theta ) * offset;

				// Correct the planar sample density to solid angle.
				float weight = sin( theta ) / theta;

				accumColor += weight * textureLod( envMap, sampleDirection, 0.0 ).rgb;
				accumWeight += weight;

			}

			gl_FragColor = vec4( accumColor / accumWeight, 1.0 );

		}
	`)}function Sg(){return Ya("PMREMEquirectangularToCubemap",{envMap:{value:null}},`

		varying vec3 vWorldDirection;

		uniform sampler2D envMap;

		#include <common>

		void main() {

			// Average four subpixel samples to preserve small, bright features.
			vec3 direction = normalize( vWorldDirection );
			vec3 dx = dFdx( direction ) * 0.25;
			vec3 dy = dFdy( direction ) * 0.25;

			vec3 color = textureLod( envMap, equirectUv( normalize( direction - dx - dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction + dx - dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction - dx + dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction + dx + dy ) ), 0.0 ).rgb;
			gl_FragColor = vec4( color * 0.25, 1.0 );

		}
	`)}function Mg(){return Ya("PMREMCubemapToCubemap",{envMap:{value:null},flipEnvMap:{value:-1}},`

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float flipEnvMap;

		void main() {

			gl_FragColor = vec4( textureCube( envMap, vec3( flipEnvMap * vWorldDirection.x, vWorldDirection.yz ) ).rgb, 1.0 );

		}
	`)}function HS(n){let e=new WeakMap,t=new WeakMap,i=null;function s(h,f=!1){return h==null?null:f?o(h):r(h)}function r(h){if(h&&h.isTexture){let f=h.mapping;if(f===Ic||f===Lc)if(e.has(h)){let m=e.get(h).texture;return a(m,h.mapping)}else{let m=h.image;if(m&&m.height>0){let y=new qa(m.height);return y.fromEquirectangularTexture(n,h),e.set(h,y),h.addEventListener("dispose",c),a(y.texture,h.mapping)}else return null}}return h}function o(h){if(h&&h.isTexture&&h.isPMREMTexture!==!0){let f=h.mapping,m=f===Ic||f===Lc,y=f===gr||f===vo;if(m||y){let g=t.get(h),_=g!==void 0?g.texture.pmremVersion:0;if(h.isRenderTargetTexture&&h.pmremVersion!==_)return i===null&&(i=new yu(n)),g=m?i.fromEquirectangular(h,g):i.fromCubemap(h,g),g.texture.pmremVersion=h.pmremVersion,t.set(h,g),g.texture;if(g!==void 0)return g.texture;{let b=h.image;return m&&b&&b.height>0||y&&b&&l(b)?(i===null&&(i=new yu(n)),g=m?i.fromEquirectangular(h):i.fromCubemap(h),g.texture.pmremVersion=h.pmremVersion,t.set(h,g),h.addEventListener("dispose",u),g.texture):null}}}return h}function a(h,f){return f===Ic?h.mapping=gr:f===Lc&&(h.mapping=vo),h}function l(h){let f=0,m=6;for(let y=0;y<m;y++)h[y]!==void 0&&f++;return f===m}function c(h){let f=h.target;f.removeEventListener("dispose",c);let m=e.get(f);m!==void 0&&(e.delete(f),m.dispose())}function u(h){let f=h.target;f.removeEventListener("dispose",u);let m=t.get(f);m!==void 0&&(t.delete(f),m.dispose())}function d(){e=new WeakMap,t=new WeakMap,i!==null&&(i.dispose(),i=null)}return{get:s,dispose:d}}function WS(n){let e={};function t(i){if(e[i]!==void 0)return e[i];let s=n.getExtension(i);return e[i]=s,s}return{has:function(i){return t(i)!==null},init:function(){t("EXT_color_buffer_float"),t("WEBGL_clip_cull_distance"),t("OES_texture_float_linear"),t("EXT_color_buffer_half_float"),t("WEBGL_multisampled_render_to_texture"),t("WEBGL_render_shared_exponent")},get:function(i){let s=t(i);return s===null&&ra("WebGLRenderer: "+i+" extension not supported."),s}}}function XS(n,e,t,i){let s={},r=new WeakMap,o=new FinalizationRegistry(m=>delete s[m]);function a(m){l(m.target)}function l(m){m.index!==null&&e.remove(m.index);for(let g in m.attributes)e.remove(m.attributes[g]);m.removeEventListener("dispose",a),delete s[m.id],o.unregister(m);let y=r.get(m);y&&(e.remove(y),r.delete(m)),i.releaseStatesOfGeometry(m),m.isInstancedBufferGeometry===!0&&delete m._maxInstanceCount,t.memory.geometries--}function c(m,y){return s[y.id]!==void 0||(y.addEventListener("dispose",a),s[y.id]=new WeakRef(y),o.register(y,y.id,y),t.memory.geometries++),y}function u(m){let y=m.attributes;for(let g in y)e.update(y[g],n.ARRAY_BUFFER)}function d(m){let y=m.index,g=m.attributes.position,_=0;if(g===void 0)return;let b=y!==null?y.array.length:g.array.length/3-1,C=g.count>=65535?ga:ma,S=new C(Math.ceil(b/3)*6,1),P=S.array;if(y!==null){let x=y.array;_=y.version;for(let w=0,F=0;w<b;w+=3){let D=x[w+0],L=x[w+1],B=x[w+2];P[F++]=D,P[F++]=L,P[F++]=L,P[F++]=B,P[F++]=B,P[F++]=D}}else{_=g.version;for(let x=0,w=0;x<b;x+=3){let F=x+0,D=x+1,L=x+2;P[w++]=F,P[w++]=D,P[w++]=D,P[w++]=L,P[w++]=L,P[w++]=F}}S.version=_;let A=r.get(m);A&&e.remove(A),r.set(m,S)}function h(m){let y=r.get(m);if(y){let g=m.index;g!==null&&y.version<g.version&&d(m)}else d(m);return r.get(m)}function f(){for(let m in s){let y=s[m].deref();y!==void 0&&l(y)}}return{get:c,update:u,getWireframeAttribute:h,dispose:f}}function qS(n,e,t){let i;function s(d){i=d}let r,o;function a(d){r=d.type,o=d.bytesPerElement}function l(d,h){n.drawElements(i,h,r,d*o),t.update(h,i,1)}function c(d,h,f){f!==0&&(n.drawElementsInstanced(i,h,r,d*o,f),t.update(h,i,f))}function u(d,h,f){if(f===0)return;e.get("WEBGL_multi_draw").multiDrawElementsWEBGL(i,h,0,r,d,0,f);let y=0;for(let g=0;g<f;g++)y+=h[g];t.update(y,i,1)}this.setMode=s,this.setIndex=a,this.render=l,this.renderInstances=c,this.renderMultiDraw=u}function YS(n){let e={geometries:0,textures:0},t={frame:0,calls:0,triangles:0,points:0,lines:0};function i(r,o,a){switch(t.calls++,o){case n.TRIANGLES:t.triangles+=a*(r/3);break;case n.LINES:t.lines+=a*(r/2);break;case n.LINE_STRIP:t.lines+=a*(r-1);break;case n.LINE_LOOP:t.lines+=a*r;break;case n.POINTS:t.points+=a*r;break;default:Qe("WebGLInfo: Unknown draw mode:",o);break}}function s(){t.calls=0,t.triangles=0,t.points=0,t.lines=0}return{memory:e,render:t,programs:null,autoReset:!0,reset:s,update:i}}function $S(n,e,t){let i=new WeakMap,s=new jt;function r(o,a,l){let c=o.morphTargetInfluences,u=a.morphAttributes.position||a.morphAttributes.normal||a.morphAttributes.color,d=u!==void 0?u.length:0,h=i.get(a);if(h===void 0||h.count!==d){let F=function(){x.dispose(),i.delete(a),a.removeEventListener("dispose",F)};h!==void 0&&h.texture.dispose();let f=a.morphAttributes.position!==void 0,m=a.morphAttributes.normal!==void 0,y=a.morphAttributes.color!==void 0,g=a.morphAttributes.position||[],_=a.morphAttributes.normal||[],b=a.morphAttributes.color||[],C=0;f===!0&&(C=1),m===!0&&(C=2),y===!0&&(C=3);let S=a.attributes.position.count*C,P=1;S>e.maxTextureSize&&(P=Math.ceil(S/e.maxTextureSize),S=e.maxTextureSize);let A=new Float32Array(S*P*4*d),x=new da(A,S,P,d);x.type=ki,x.needsUpdate=!0;let w=C*4;for(let D=0;D<d;D++){let L=g[D],B=_[D],V=b[D],U=S*P*4*D;for(let X=0;X<L.count;X++){let $=X*w;f===!0&&(s.fromBufferAttribute(L,X),A[U+$+0]=s.x,A[U+$+1]=s.y,A[U+$+2]=s.z,A[U+$+3]=0),m===!0&&(s.fromBufferAttribute(B,X),A[U+$+4]=s.x,A[U+$+5]=s.y,A[U+$+6]=s.z,A[U+$+7]=0),y===!0&&(s.fromBufferAttribute(V,X),A[U+$+8]=s.x,A[U+$+9]=s.y,A[U+$+10]=s.z,A[U+$+11]=V.itemSize===4?s.w:1)}}h={count:d,texture:x,size:new qe(S,P)},i.set(a,h),a.addEventListener("dispose",F)}if(o.isInstancedMesh===!0&&o.morphTexture!==null)l.getUniforms().setValue(n,"morphTexture",o.morphTexture,t);else{let f=0;for(let y=0;y<c.length;y++)f+=c[y];let m=a.morphTargetsRelative?1:1-f;l.getUniforms().setValue(n,"morphTargetBaseInfluence",m),l.getUniforms().setValue(n,"morphTargetInfluences",c)}l.getUniforms().setValue(n,"morphTargetsTexture",h.texture,t),l.getUniforms().setValue(n,"morphTargetsTextureSize",h.size)}return{update:r}}function ZS(n,e,t,i,s){let r=new WeakMap;function o(c){let u=s.render.frame,d=c.geometry,h=e.get(c,d);if(r.get(h)!==u&&(e.update(h),r.set(h,u)),c.isInstancedMesh&&(c.hasEventListener("dispose",l)===!1&&c.addEventListener("dispose",l),r.get(c)!==u&&(t.update(c.instanceMatrix,n.ARRAY_BUFFER),c.instanceColor!==null&&t.update(c.instanceColor,n.ARRAY_BUFFER),r.set(c,u))),c.isSkinnedMesh){let f=c.skeleton;r.get(f)!==u&&(f.update(),r.set(f,u))}return h}function a(){r=new WeakMap}function l(c){let u=c.target;u.removeEventListener("dispose",l),i.releaseStatesOfObject(u),t.remove(u.instanceMatrix),u.instanceColor!==null&&t.remove(u.instanceColor)}return{update:o,dispose:a}}var JS={[xd]:"LINEAR_TONE_MAPPING",[vd]:"REINHARD_TONE_MAPPING",[yd]:"CINEON_TONE_MAPPING",[bd]:"ACES_FILMIC_TONE_MAPPING",[Md]:"AGX_TONE_MAPPING",[wd]:"NEUTRAL_TONE_MAPPING",[Sd]:"CUSTOM_TONE_MAPPING"};function KS(n,e,t,i,s,r){let o=new mi(e,t,{type:n,depthBuffer:s,stencilBuffer:r,samples:i?4:0,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,resolveDepthBuffer:!1,resolveStencilBuffer:!1}),a=null,l=null,c=null,u=new Bn;u.setAttribute("position",new en([-1,3,0,-1,-1,0,3,-1,0],3)),u.setAttribute("uv",new en([0,2,0,0,2,0],2));let d=new gc({uniforms:{tDiffuse:{value:null}},vertexShader:`
			precision highp float;

			uniform mat4 modelViewMatrix;
			uniform mat4 projectionMatrix;

			attribute vec3 position;
			attribute vec2 uv;

			varying vec2 vUv;

			void main() {
				vUv = uv;
				gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
			}`,fragmentShader:`
			precision highp float;

			uniform sampler2D tDiffuse;

			varying vec2 vUv;

			#include <tonemapping_pars_fragment>
			#include <colorspace_pars_fragment>

			void main() {
				gl_FragColor = texture2D( tDiffuse, vUv );

				#ifdef LINEAR_TONE_MAPPING
					gl_FragColor.rgb = LinearToneMapping( gl_FragColor.rgb );
				#elif defined( REINHARD_TONE_MAPPING )
					gl_FragColor.rgb = ReinhardToneMapping( gl_FragColor.rgb );
				#elif defined( CINEON_TONE_MAPPING )
					gl_FragColor.rgb = CineonToneMapping( gl_FragColor.rgb );
				#elif defined( ACES_FILMIC_TONE_MAPPING )
					gl_FragColor.rgb = ACESFilmicToneMapping( gl_FragColor.rgb );
				#elif defined( AGX_TONE_MAPPING )
					gl_FragColor.rgb = AgXToneMapping( gl_FragColor.rgb );
				#elif defined( NEUTRAL_TONE_MAPPING )
					gl_FragColor.rgb = NeutralToneMapping( gl_FragColor.rgb );
				#elif defined( CUSTOM_TONE_MAPPING )
					gl_FragColor.rgb = CustomToneMapping( gl_FragColor.rgb );
				#endif

				#ifdef SRGB_TRANSFER
					gl_FragColor = sRGBTransferOETF( gl_FragColor );
				#endif
			}`,depthTest:!1,depthWrite:!1}),h=new ri(u,d),f=new Da(-1,1,1,-1,0,1),m=null,y=null,g=!1,_,b=null,C=[],S=!1;this.setSize=function(P,A){o.setSize(P,A),a!==null&&a.setSize(P,A),l!==null&&l.setSize(P,A);for(let x=0;x<C.length;x++){let w=C[x];w.setSize&&w.setSize(P,A)}},this.setEffects=function(P){C=P,S=C.length>0&&C[0].isRenderPass===!0;let A=o.width,x=o.height;C.length>0&&a===null&&(a=new mi(A,x,{type:Bi,depthBuffer:!1,stencilBuffer:!1}),l=new mi(A,x,{type:Bi,depthBuffer:!1,stencilBuffer:!1}));let w=s===!0&&C.some(F=>F.needsDepthTexture===!0);w!==(o.depthTexture!==null)&&(w===!0&&c===null&&(c=new ws(A,x),r===!0&&(c.format=As,c.type=_r)),o.dispose(),o.depthTexture=w?c:null,o.resolveDepthBuffer=w,o.storeMultisampledDepthBuffer=w);for(let F=0;F<C.length;F++){let D=C[F];D.setSize&&D.setSize(A,x),w&&D.needsDepthTexture===!0&&D.setDepthTexture&&D.setDepthTexture(c)}},this.begin=function(P,A){if(g||P.toneMapping===is&&C.length===0)return!1;if(b=A,A!==null){let x=A.width,w=A.height;(o.width!==x||o.height!==w)&&this.setSize(x,w)}return S===!1&&P.setRenderTarget(o),_=P.toneMapping,P.toneMapping=is,!0},this.hasRenderPass=function(){return S},this.end=function(P,A){P.toneMapping=_,g=!0;let x=o,w=a;for(let F=0;F<C.length;F++){let D=C[F];D.enabled!==!1&&(D.render(P,w,x,A),D.needsSwap!==!1&&(x=w,w=w===a?l:a))}if(m!==P.outputColorSpace||y!==P.toneMapping){m=P.outputColorSpace,y=P.toneMapping,d.defines={},yt.getTransfer(m)===Rt&&(d.defines.SRGB_TRANSFER="");let F=JS[y];F&&(d.defines[F]=""),d.needsUpdate=!0}d.uniforms.tDiffuse.value=x.texture,P.setRenderTarget(b),P.render(h,f),b=null,g=!1},this.isCompositing=function(){return g},this.dispose=function(){o.dispose(),a!==null&&a.dispose(),l!==null&&l.dispose(),u.dispose(),d.dispose()}}var Xg=new ei,qg=new ws(1,1),Yg=new Sa(1),$g=new da,Zg=new cc,Jg=new ya,wg=[],Tg=[],Eg=new Float32Array(16),Ag=new Float32Array(9),Cg=new Float32Array(4);function So(n,e,t){let i=n[0];if(i<=0||i>0)return n;let s=e*t,r=wg[s];if(r===void 0&&(r=new Float32Array(s),wg[s]=r),e!==0){i.toArray(r,0);for(let o=1,a=0;o!==e;++o)a+=t,n[o].toArray(r,a)}return r}function Mn(n,e){if(n.length!==e.length)return!1;for(let t=0,i=n.length;t<i;t++)if(n[t]!==e[t])return!1;return!0}function wn(n,e){for(let t=0,i=e.length;t<i;t++)n[t]=e[t]}function Su(n,e){let t=Tg[e];t===void 0&&(t=new Int32Array(e),Tg[e]=t);for(let i=0;i!==e;++i)t[i]=n.allocateTextureUnit();return t}function jS(n,e){let t=this.cache;t[0]!==e&&(n.uniform1f(this.addr,e),t[0]=e)}function QS(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2f(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(Mn(t,e))return;n.uniform2fv(this.addr,e),wn(t,e)}}function eM(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3f(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else if(e.r!==void 0)(t[0]!==e.r||t[1]!==e.g||t[2]!==e.b)&&(n.uniform3f(this.addr,e.r,e.g,e.b),t[0]=e.r,t[1]=e.g,t[2]=e.b);else{if(Mn(t,e))return;n.uniform3fv(this.addr,e),wn(t,e)}}function tM(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4f(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(Mn(t,e))return;n.uniform4fv(this.addr,e),wn(t,e)}}function nM(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(Mn(t,e))return;n.uniformMatrix2fv(this.addr,!1,e),wn(t,e)}else{if(Mn(t,i))return;Cg.set(i),n.uniformMatrix2fv(this.addr,!1,Cg),wn(t,i)}}function iM(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(Mn(t,e))return;n.uniformMatrix3fv(this.addr,!1,e),wn(t,e)}else{if(Mn(t,i))return;Ag.set(i),n.uniformMatrix3fv(this.addr,!1,Ag),wn(t,i)}}function sM(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(Mn(t,e))return;n.uniformMatrix4fv(this.addr,!1,e),wn(t,e)}else{if(Mn(t,i))return;Eg.set(i),n.uniformMatrix4fv(this.addr,!1,Eg),wn(t,i)}}function rM(n,e){let t=this.cache;t[0]!==e&&(n.uniform1i(this.addr,e),t[0]=e)}function oM(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2i(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(Mn(t,e))return;n.uniform2iv(this.addr,e),wn(t,e)}}function aM(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3i(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else{if(Mn(t,e))return;n.uniform3iv(this.addr,e),wn(t,e)}}function lM(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4i(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(Mn(t,e))return;n.uniform4iv(this.addr,e),wn(t,e)}}function cM(n,e){let t=this.cache;t[0]!==e&&(n.uniform1ui(this.addr,e),t[0]=e)}function uM(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2ui(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(Mn(t,e))return;n.uniform2uiv(this.addr,e),wn(t,e)}}function hM(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3ui(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else{if(Mn(t,e))return;n.uniform3uiv(this.addr,e),wn(t,e)}}function dM(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4ui(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(Mn(t,e))return;n.uniform4uiv(this.addr,e),wn(t,e)}}function Mu(n){return n.version===0&&(n.compareFunction=Ud,n.needsUpdate=!0),n}function fM(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s);let r;this.type===n.SAMPLER_2D_SHADOW?r=Mu(qg):r=Xg,t.setTexture2D(e||r,s)}function pM(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s),t.setTexture3D(e||Zg,s)}function mM(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s);let r;this.type===n.SAMPLER_CUBE_SHADOW?r=Mu(Yg):r=Jg,t.setTextureCube(e||r,s)}function gM(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s),t.setTexture2DArray(e||$g,s)}function _M(n){switch(n){case 5126:return jS;case 35664:return QS;case 35665:return eM;case 35666:return tM;case 35674:return nM;case 35675:return iM;case 35676:return sM;case 5124:case 35670:return rM;case 35667:case 35671:return oM;case 35668:case 35672:return aM;case 35669:case 35673:return lM;case 5125:return cM;case 36294:return uM;case 36295:return hM;case 36296:return dM;case 35678:case 36198:case 36298:case 36306:case 35682:return fM;case 35679:case 36299:case 36307:return pM;case 35680:case 36300:case 36308:case 36293:return mM;case 36289:case 36303:case 36311:case 36292:return gM}}function xM(n,e){n.uniform1fv(this.addr,e)}function vM(n,e){let t=So(e,this.size,2);n.uniform2fv(this.addr,t)}function yM(n,e){let t=So(e,this.size,3);n.uniform3fv(this.addr,t)}function bM(n,e){let t=So(e,this.size,4);n.uniform4fv(this.addr,t)}function SM(n,e){let t=So(e,this.size,4);n.uniformMatrix2fv(this.addr,!1,t)}function MM(n,e){let t=So(e,this.size,9);n.uniformMatrix3fv(this.addr,!1,t)}function wM(n,e){let t=So(e,this.size,16);n.uniformMatrix4fv(this.addr,!1,t)}function TM(n,e){n.uniform1iv(this.addr,e)}function EM(n,e){n.uniform2iv(this.addr,e)}function AM(n,e){n.uniform3iv(this.addr,e)}function CM(n,e){n.uniform4iv(this.addr,e)}function RM(n,e){n.uniform1uiv(this.addr,e)}function PM(n,e){n.uniform2uiv(this.addr,e)}function IM(n,e){n.uniform3uiv(this.addr,e)}function LM(n,e){n.uniform4uiv(this.addr,e)}function DM(n,e,t){let i=this.cache,s=e.length,r=Su(t,s);Mn(i,r)||(n.uniform1iv(this.addr,r),wn(i,r));let o;this.type===n.SAMPLER_2D_SHADOW?o=Mu(qg):o=Xg;for(let a=0;a!==s;++a)t.setTexture2D(e[a]||o,r[a])}function NM(n,e,t){let i=this.cache,s=e.length,r=Su(t,s);Mn(i,r)||(n.uniform1iv(this.addr,r),wn(i,r));for(let o=0;o!==s;++o)t.setTexture3D(e[o]||Zg,r[o])}function UM(n,e,t){let i=this.cache,s=e.length,r=Su(t,s);Mn(i,r)||(n.uniform1iv(this.addr,r),wn(i,r));let o;this.type===n.SAMPLER_CUBE_SHADOW?o=Mu(Yg):o=Jg;for(let a=0;a!==s;++a)t.setTextureCube(e[a]||o,r[a])}function OM(n,e,t){let i=this.cache,s=e.length,r=Su(t,s);Mn(i,r)||(n.uniform1iv(this.addr,r),wn(i,r));for(let o=0;o!==s;++o)t.setTexture2DArray(e[o]||$g,r[o])}function FM(n){switch(n){case 5126:return xM;case 35664:return vM;case 35665:return yM;case 35666:return bM;case 35674:return SM;case 35675:return MM;case 35676:return wM;case 5124:case 35670:return TM;case 35667:case 35671:return EM;case 35668:case 35672:return AM;case 35669:case 35673:return CM;case 5125:return RM;case 36294:return PM;case 36295:return IM;case 36296:return LM;case 35678:case 36198:case 36298:case 36306:case 35682:return DM;case 35679:case 36299:case 36307:return NM;case 35680:case 36300:case 36308:case 36293:return UM;case 36289:case 36303:case 36311:case 36292:return OM}}var Zd=class{constructor(e,t,i){this.id=e,this.addr=i,this.cache=[],this.type=t.type,this.setValue=_M(t.type)}},Jd=class{constructor(e,t,i){this.id=e,this.addr=i,this.cache=[],this.type=t.type,this.size=t.size,this.setValue=FM(t.type)}},Kd=class{constructor(e){this.id=e,this.seq=[],this.map={}}setValue(e,t,i){let s=this.seq;for(let r=0,o=s.length;r!==o;++r){let a=s[r];a.setValue(e,t[a.id],i)}}},Yd=/(\w+)(\])?(\[|\.)?/g;function Rg(n,e){n.seq.push(e),n.map[e.id]=e}function kM(n,e,t){let i=n.name,s=i.length;for(Yd.lastIndex=0;;){let r=Yd.exec(i),o=Yd.lastIndex,a=r[1],l=r[2]==="]",c=r[3];if(l&&(a=a|0),c===void 0||c==="["&&o+2===s){Rg(t,c===void 0?new Zd(a,n,e):new Jd(a,n,e));break}else{let d=t.map[a];d===void 0&&(d=new Kd(a),Rg(t,d)),t=d}}}var bo=class{constructor(e,t){this.seq=[],this.map={};let i=e.getProgramParameter(t,e.ACTIVE_UNIFORMS);for(let o=0;o<i;++o){let a=e.getActiveUniform(t,o),l=e.getUniformLocation(t,a.name);kM(a,l,this)}let s=[],r=[];for(let o of this.seq)o.type===e.SAMPLER_2D_SHADOW||o.type===e.SAMPLER_CUBE_SHADOW||o.type===e.SAMPLER_2D_ARRAY_SHADOW?s.push(o):r.push(o);s.length>0&&(this.seq=s.concat(r))}setValue(e,t,i,s){let r=this.map[t];r!==void 0&&r.setValue(e,i,s)}setOptional(e,t,i){let s=t[i];s!==void 0&&this.setValue(e,i,s)}static upload(e,t,i,s){for(let r=0,o=t.length;r!==o;++r){let a=t[r],l=i[a.id];l.needsUpdate!==!1&&a.setValue(e,l.value,s)}}static seqWithValue(e,t){let i=[];for(let s=0,r=e.length;s!==r;++s){let o=e[s];o.id in t&&i.push(o)}return i}};function Pg(n,e,t){let i=n.createShader(e);return n.shaderSource(i,t),n.compileShader(i),i}var BM=37297,zM=0;function VM(n,e){let t=n.split(`
`),i=[],s=Math.max(e-6,0),r=Math.min(e+6,t.length);for(let o=s;o<r;o++){let a=o+1;i.push(`${a===e?">":" "} ${a}: ${t[o]}`)}return i.join(`
`)}var Ig=new nt;function GM(n){yt._getMatrix(Ig,yt.workingColorSpace,n);let e=`mat3( ${Ig.elements.map(t=>t.toFixed(4))} )`;switch(yt.getTransfer(n)){case ca:return[e,"LinearTransferOETF"];case Rt:return[e,"sRGBTransferOETF"];default:return $e("WebGLProgram: Unsupported color space: ",n),[e,"LinearTransferOETF"]}}function Lg(n,e,t){let i=n.getShaderParameter(e,n.COMPILE_STATUS),r=(n.getShaderInfoLog(e)||"").trim();if(i&&r==="")return"";let o=/ERROR: 0:(\d+)/.exec(r);if(o){let a=parseInt(o[1]);return t.toUpperCase()+`

`+r+`

`+VM(n.getShaderSource(e),a)}else return r}function HM(n,e){let t=GM(e);return[`vec4 ${n}( vec4 value ) {`,`	return ${t[1]}( vec4( ${t[0]} * value.rgb, value.a ) );`,"}"].join(`
`)}var WM={[xd]:"Linear",[vd]:"Reinhard",[yd]:"Cineon",[bd]:"ACESFilmic",[Md]:"AgX",[wd]:"Neutral",[Sd]:"Custom"};function XM(n,e){let t=WM[e];return t===void 0?($e("WebGLProgram: Unsupported toneMapping:",e),"vec3 "+n+"( vec3 color ) { return LinearToneMapping( color ); }"):"vec3 "+n+"( vec3 color ) { return "+t+"ToneMapping( color ); }"}var vu=new H;function qM(){yt.getLuminanceCoefficients(vu);let n=vu.x.toFixed(4),e=vu.y.toFixed(4),t=vu.z.toFixed(4);return["float luminance( const in vec3 rgb ) {",`	const vec3 weights = vec3( ${n}, ${e}, ${t} );`,"	return dot( weights, rgb );","}"].join(`
`)}function YM(n){return[n.extensionClipCullDistance?"#extension GL_ANGLE_clip_cull_distance : require":"",n.extensionMultiDraw?"#extension GL_ANGLE_multi_draw : require":""].filter(Xa).join(`
`)}function $M(n){let e=[];for(let t in n){let i=n[t];i!==!1&&e.push("#define "+t+" "+i)}return e.join(`
`)}function ZM(n,e){let t={},i=n.getProgramParameter(e,n.ACTIVE_ATTRIBUTES);for(let s=0;s<i;s++){let r=n.getActiveAttrib(e,s),o=r.name,a=1;r.type===n.FLOAT_MAT2&&(a=2),r.type===n.FLOAT_MAT3&&(a=3),r.type===n.FLOAT_MAT4&&(a=4),t[o]={type:r.type,location:n.getAttribLocation(e,o),locationSize:a}}return t}function Xa(n){return n!==""}function Dg(n,e){let t=e.numSpotLightShadows+e.numSpotLightMaps-e.numSpotLightShadowsWithMaps;return n.replace(/NUM_SUN_LIGHTS/g,e.numSunLights).replace(/NUM_DIR_LIGHTS/g,e.numDirLights).replace(/NUM_SPOT_LIGHTS/g,e.numSpotLights).replace(/NUM_SPOT_LIGHT_MAPS/g,e.numSpotLightMaps).replace(/NUM_SPOT_LIGHT_COORDS/g,t).replace(/NUM_RECT_AREA_LIGHTS/g,e.numRectAreaLights).replace(/NUM_POINT_LIGHTS/g,e.numPointLights).replace(/NUM_HEMI_LIGHTS/g,e.numHemiLights).replace(/NUM_SUN_LIGHT_SHADOWS/g,e.numSunLightShadows).replace(/NUM_DIR_LIGHT_SHADOWS/g,e.numDirLightShadows).replace(/NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS/g,e.numSpotLightShadowsWithMaps).replace(/NUM_SPOT_LIGHT_SHADOWS/g,e.numSpotLightShadows).replace(/NUM_POINT_LIGHT_SHADOWS/g,e.numPointLightShadows).replace(/NUM_LIGHT_PROBE_GRIDS/g,e.numLightProbeGrids)}function Ng(n,e){return n.replace(/NUM_CLIPPING_PLANES/g,e.numClippingPlanes).replace(/UNION_CLIPPING_PLANES/g,e.numClippingPlanes-e.numClipIntersection)}var JM=/^[ \t]*#include +<([\w\d./]+)>/gm;function jd(n){return n.replace(JM,KM)}function KM(n,e){let t=ht[e];if(t===void 0)throw new Error("THREE.WebGLProgram: Can not resolve #include <"+e+">");return jd(t)}var jM=/#pragma unroll_loop_start\s+for\s*\(\s*int\s+i\s*=\s*(\d+)\s*;\s*i\s*<\s*(\d+)\s*;\s*i\s*\+\+\s*\)\s*{([\s\S]+?)}\s+#pragma unroll_loop_end/g;function Ug(n){return n.replace(jM,QM)}function QM(n,e,t,i){let s="";for(let r=parseInt(e);r<parseInt(t);r++)s+=i.replace(/\[\s*i\s*\]/g,"[ "+r+" ]").replace(/UNROLLED_LOOP_INDEX/g,r);return s}function Og(n){let e=`precision ${n.precision} float;
	precision ${n.precision} int;
	precision ${n.precision} sampler2D;
	precision ${n.precision} samplerCube;
	precision ${n.precision} sampler3D;
	precision ${n.precision} sampler2DArray;
	precision ${n.precision} sampler2DShadow;
	precision ${n.precision} samplerCubeShadow;
	precision ${n.precision} sampler2DArrayShadow;
	precision ${n.precision} isampler2D;
	precision ${n.precision} isampler3D;
	precision ${n.precision} isamplerCube;
	precision ${n.precision} isampler2DArray;
	precision ${n.precision} usampler2D;
	precision ${n.precision} usampler3D;
	precision ${n.precision} usamplerCube;
	precision ${n.precision} usampler2DArray;
	`;return n.precision==="highp"?e+=`
#define HIGH_PRECISION`:n.precision==="mediump"?e+=`
#define MEDIUM_PRECISION`:n.precision==="lowp"&&(e+=`
#define LOW_PRECISION`),e}var ew={[Oa]:"SHADOWMAP_TYPE_PCF",[_o]:"SHADOWMAP_TYPE_VSM"};function tw(n){return ew[n.shadowMapType]||"SHADOWMAP_TYPE_BASIC"}var nw={[vo]:"ENVMAP_MODE_REFRACTION"};function iw(n){return n.envMap===!1?"ENVMAP_MODE_REFLECTION":nw[n.envMapMode]||"ENVMAP_MODE_REFLECTION"}var sw={[_d]:"ENVMAP_BLENDING_MULTIPLY",[eg]:"ENVMAP_BLENDING_MIX",[tg]:"ENVMAP_BLENDING_ADD"};function rw(n){return n.envMap===!1?"ENVMAP_BLENDING_NONE":sw[n.combine]||"ENVMAP_BLENDING_NONE"}function ow(n,e,t,i){let s=n.getContext(),r=t.defines,o=t.vertexShader,a=t.fragmentShader,l=tw(t),c=t.envMapPMREM===!0?"ENVMAP_TYPE_PMREM":"ENVMAP_TYPE_CUBE",u=iw(t),d=rw(t),h=YM(t),f=$M(r),m=s.createProgram(),y,g,_=t.glslVersion?"#version "+t.glslVersion+`
`:"";t.isRawShaderMaterial?(y=["#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,f].filter(Xa).join(`
`),y.length>0&&(y+=`
`),g=["#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,f].filter(Xa).join(`
`),g.length>0&&(g+=`
`)):(y=[Og(t),"#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,f,t.extensionClipCullDistance?"#define USE_CLIP_DISTANCE":"",t.batching?"#define USE_BATCHING":"",t.batchingColor?"#define USE_BATCHING_COLOR":"",t.instancing?"#define USE_INSTANCING":"",t.instancingColor?"#define USE_INSTANCING_COLOR":"",t.instancingMorph?"#define USE_INSTANCING_MORPH":"",t.useFog&&t.fog?"#define USE_FOG":"",t.useFog&&t.fogExp2?"#define FOG_EXP2":"",t.map?"#define USE_MAP":"",t.envMap?"#define USE_ENVMAP":"",t.envMap?"#define "+u:"",t.lightMap?"#define USE_LIGHTMAP":"",t.aoMap?"#define USE_AOMAP":"",t.bumpMap?"#define USE_BUMPMAP":"",t.normalMap?"#define USE_NORMALMAP":"",t.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",t.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",t.displacementMap?"#define USE_DISPLACEMENTMAP":"",t.emissiveMap?"#define USE_EMISSIVEMAP":"",t.anisotropy?"#define USE_ANISOTROPY":"",t.anisotropyMap?"#define USE_ANISOTROPYMAP":"",t.clearcoatMap?"#define USE_CLEARCOATMAP":"",t.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",t.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",t.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",t.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",t.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",t.specularMap?"#define USE_SPECULARMAP":"",t.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",t.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",t.roughnessMap?"#define USE_ROUGHNESSMAP":"",t.metalnessMap?"#define USE_METALNESSMAP":"",t.alphaMap?"#define USE_ALPHAMAP":"",t.alphaHash?"#define USE_ALPHAHASH":"",t.transmission?"#define USE_TRANSMISSION":"",t.transmissionMap?"#define USE_TRANSMISSIONMAP":"",t.thicknessMap?"#define USE_THICKNESSMAP":"",t.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",t.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",t.mapUv?"#define MAP_UV "+t.mapUv:"",t.alphaMapUv?"#define ALPHAMAP_UV "+t.alphaMapUv:"",t.lightMapUv?"#define LIGHTMAP_UV "+t.lightMapUv:"",t.aoMapUv?"#define AOMAP_UV "+t.aoMapUv:"",t.emissiveMapUv?"#define EMISSIVEMAP_UV "+t.emissiveMapUv:"",t.bumpMapUv?"#define BUMPMAP_UV "+t.bumpMapUv:"",t.normalMapUv?"#define NORMALMAP_UV "+t.normalMapUv:"",t.displacementMapUv?"#define DISPLACEMENTMAP_UV "+t.displacementMapUv:"",t.metalnessMapUv?"#define METALNESSMAP_UV "+t.metalnessMapUv:"",t.roughnessMapUv?"#define ROUGHNESSMAP_UV "+t.roughnessMapUv:"",t.anisotropyMapUv?"#define ANISOTROPYMAP_UV "+t.anisotropyMapUv:"",t.clearcoatMapUv?"#define CLEARCOATMAP_UV "+t.clearcoatMapUv:"",t.clearcoatNormalMapUv?"#define CLEARCOAT_NORMALMAP_UV "+t.clearcoatNormalMapUv:"",t.clearcoatRoughnessMapUv?"#define CLEARCOAT_ROUGHNESSMAP_UV "+t.clearcoatRoughnessMapUv:"",t.diffuseRoughnessMapUv?"#define DIFFUSE_ROUGHNESSMAP_UV "+t.diffuseRoughnessMapUv:"",t.iridescenceMapUv?"#define IRIDESCENCEMAP_UV "+t.iridescenceMapUv:"",t.iridescenceThicknessMapUv?"#define IRIDESCENCE_THICKNESSMAP_UV "+t.iridescenceThicknessMapUv:"",t.sheenColorMapUv?"#define SHEEN_COLORMAP_UV "+t.sheenColorMapUv:"",t.sheenRoughnessMapUv?"#define SHEEN_ROUGHNESSMAP_UV "+t.sheenRoughnessMapUv:"",t.specularMapUv?"#define SPECULARMAP_UV "+t.specularMapUv:"",t.specularColorMapUv?"#define SPECULAR_COLORMAP_UV "+t.specularColorMapUv:"",t.specularIntensityMapUv?"#define SPECULAR_INTENSITYMAP_UV "+t.specularIntensityMapUv:"",t.transmissionMapUv?"#define TRANSMISSIONMAP_UV "+t.transmissionMapUv:"",t.thicknessMapUv?"#define THICKNESSMAP_UV "+t.thicknessMapUv:"",t.vertexTangents&&t.flatShading===!1?"#define USE_TANGENT":"",t.vertexNormals?"#define HAS_NORMAL":"",t.vertexColors?"#define USE_COLOR":"",t.vertexAlphas?"#define USE_COLOR_ALPHA":"",t.vertexUv1s?"#define USE_UV1":"",t.vertexUv2s?"#define USE_UV2":"",t.vertexUv3s?"#define USE_UV3":"",t.pointsUvs?"#define USE_POINTS_UV":"",t.flatShading?"#define FLAT_SHADED":"",t.skinning?"#define USE_SKINNING":"",t.morphTargets?"#define USE_MORPHTARGETS":"",t.morphNormals&&t.flatShading===!1?"#define USE_MORPHNORMALS":"",t.morphColors?"#define USE_MORPHCOLORS":"",t.morphTargetsCount>0?"#define MORPHTARGETS_TEXTURE_STRIDE "+t.morphTextureStride:"",t.morphTargetsCount>0?"#define MORPHTARGETS_COUNT "+t.morphTargetsCount:"",t.doubleSided?"#define DOUBLE_SIDED":"",t.flipSided?"#define FLIP_SIDED":"",t.shadowMapEnabled?"#define USE_SHADOWMAP":"",t.shadowMapEnabled?"#define "+l:"",t.sizeAttenuation?"#define USE_SIZEATTENUATION":"",t.numLightProbes>0?"#define USE_LIGHT_PROBES":"",t.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",t.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 modelMatrix;","uniform mat4 modelViewMatrix;","uniform mat4 projectionMatrix;","uniform mat4 viewMatrix;","uniform mat3 normalMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;","#ifdef USE_INSTANCING","	attribute mat4 instanceMatrix;","#endif","#ifdef USE_INSTANCING_COLOR","	attribute vec3 instanceColor;","#endif","#ifdef USE_INSTANCING_MORPH","	uniform sampler2D morphTexture;","#endif","attribute vec3 position;","attribute vec3 normal;","attribute vec2 uv;","#ifdef USE_UV1","	attribute vec2 uv1;","#endif","#ifdef USE_UV2","	attribute vec2 uv2;","#endif","#ifdef USE_UV3","	attribute vec2 uv3;","#endif","#ifdef USE_TANGENT","	attribute vec4 tangent;","#endif","#if defined( USE_COLOR_ALPHA )","	attribute vec4 color;","#elif defined( USE_COLOR )","	attribute vec3 color;","#endif","#ifdef USE_SKINNING","	attribute vec4 skinIndex;","	attribute vec4 skinWeight;","#endif",`
`].filter(Xa).join(`
`),g=[Og(t),"#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,f,t.useFog&&t.fog?"#define USE_FOG":"",t.useFog&&t.fogExp2?"#define FOG_EXP2":"",t.alphaToCoverage?"#define ALPHA_TO_COVERAGE":"",t.map?"#define USE_MAP":"",t.matcap?"#define USE_MATCAP":"",t.envMap?"#define USE_ENVMAP":"",t.envMap?"#define "+c:"",t.envMap?"#define "+u:"",t.envMap?"#define "+d:"",t.envMapPMREM?"#define ENVMAP_MAX_LOD "+t.envMapMaxLod+".0":"",t.envMapPMREM?"#define ENVMAP_SIZE "+t.envMapSize+".0":"",t.lightMap?"#define USE_LIGHTMAP":"",t.aoMap?"#define USE_AOMAP":"",t.bumpMap?"#define USE_BUMPMAP":"",t.normalMap?"#define USE_NORMALMAP":"",t.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",t.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",t.packedNormalMap?"#define USE_PACKED_NORMALMAP":"",t.emissiveMap?"#define USE_EMISSIVEMAP":"",t.anisotropy?"#define USE_ANISOTROPY":"",t.anisotropyMap?"#define USE_ANISOTROPYMAP":"",t.clearcoat?"#define USE_CLEARCOAT":"",t.clearcoatMap?"#define USE_CLEARCOATMAP":"",t.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",t.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",t.diffuseRoughness?"#define USE_DIFFUSE_ROUGHNESS":"",t.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",t.dispersion?"#define USE_DISPERSION":"",t.retroreflection?"#define USE_RETROREFLECTION":"",t.iridescence?"#define USE_IRIDESCENCE":"",t.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",t.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",t.specularMap?"#define USE_SPECULARMAP":"",t.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",t.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",t.roughnessMap?"#define USE_ROUGHNESSMAP":"",t.metalnessMap?"#define USE_METALNESSMAP":"",t.alphaMap?"#define USE_ALPHAMAP":"",t.alphaTest?"#define USE_ALPHATEST":"",t.alphaHash?"#define USE_ALPHAHASH":"",t.sheen?"#define USE_SHEEN":"",t.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",t.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",t.transmission?"#define USE_TRANSMISSION":"",t.transmissionMap?"#define USE_TRANSMISSIONMAP":"",t.thicknessMap?"#define USE_THICKNESSMAP":"",t.vertexTangents&&t.flatShading===!1?"#define USE_TANGENT":"",t.vertexColors||t.instancingColor?"#define USE_COLOR":"",t.vertexAlphas||t.batchingColor?"#define USE_COLOR_ALPHA":"",t.vertexUv1s?"#define USE_UV1":"",t.vertexUv2s?"#define USE_UV2":"",t.vertexUv3s?"#define USE_UV3":"",t.pointsUvs?"#define USE_POINTS_UV":"",t.gradientMap?"#define USE_GRADIENTMAP":"",t.flatShading?"#define FLAT_SHADED":"",t.doubleSided?"#define DOUBLE_SIDED":"",t.flipSided?"#define FLIP_SIDED":"",t.shadowMapEnabled?"#define USE_SHADOWMAP":"",t.shadowMapEnabled?"#define "+l:"",t.premultipliedAlpha?"#define PREMULTIPLIED_ALPHA":"",t.numLightProbes>0?"#define USE_LIGHT_PROBES":"",t.decodeVideoTexture?"#define DECODE_VIDEO_TEXTURE":"",t.decodeVideoTextureEmissive?"#define DECODE_VIDEO_TEXTURE_EMISSIVE":"",t.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",t.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 viewMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;",t.toneMapping!==is?"#define TONE_MAPPING":"",t.toneMapping!==is?ht.tonemapping_pars_fragment:"",t.toneMapping!==is?XM("toneMapping",t.toneMapping):"",t.dithering?"#define DITHERING":"",t.opaque?"#define OPAQUE":"",ht.colorspace_pars_fragment,HM("linearToOutputTexel",t.outputColorSpace),qM(),t.useDepthPacking?"#define DEPTH_PACKING "+t.depthPacking:"",`
`].filter(Xa).join(`
`)),o=jd(o),o=Dg(o,t),o=Ng(o,t),a=jd(a),a=Dg(a,t),a=Ng(a,t),o=Ug(o),a=Ug(a),t.isRawShaderMaterial!==!0&&(_=`#version 300 es
`,y=[h,"#define attribute in","#define varying out","#define texture2D texture"].join(`
`)+`
`+y,g=["#define varying in",t.glslVersion===Fd?"":"layout(location = 0) out highp vec4 pc_fragColor;",t.glslVersion===Fd?"":"#define gl_FragColor pc_fragColor","#define gl_FragDepthEXT gl_FragDepth","#define texture2D texture","#define textureCube texture","#define texture2DProj textureProj","#define texture2DLodEXT textureLod","#define texture2DProjLodEXT textureProjLod","#define textureCubeLodEXT textureLod","#define texture2DGradEXT textureGrad","#define texture2DProjGradEXT textureProjGrad","#define textureCubeGradEXT textureGrad"].join(`
`)+`
`+g);let b=_+y+o,C=_+g+a,S=Pg(s,s.VERTEX_SHADER,b),P=Pg(s,s.FRAGMENT_SHADER,C);s.attachShader(m,S),s.attachShader(m,P),t.index0AttributeName!==void 0?s.bindAttribLocation(m,0,t.index0AttributeName):t.hasPositionAttribute===!0&&s.bindAttribLocation(m,0,"position"),s.linkProgram(m);function A(D){if(n.debug.checkShaderErrors){let L=s.getProgramInfoLog(m)||"",B=s.getShaderInfoLog(S)||"",V=s.getShaderInfoLog(P)||"",U=L.trim(),X=B.trim(),$=V.trim(),W=!0,ce=!0;if(s.getProgramParameter(m,s.LINK_STATUS)===!1)if(W=!1,typeof n.debug.onShaderError=="function")n.debug.onShaderError(s,m,S,P);else{let K=Lg(s,S,"vertex"),Q=Lg(s,P,"fragment");Qe("WebGLProgram: Shader Error "+s.getError()+" - VALIDATE_STATUS "+s.getProgramParameter(m,s.VALIDATE_STATUS)+`

Material Name: `+D.name+`
Material Type: `+D.type+`

Program Info Log: `+U+`
`+K+`
`+Q)}else U!==""?$e("WebGLProgram: Program Info Log:",U):(X===""||$==="")&&(ce=!1);ce&&(D.diagnostics={runnable:W,programLog:U,vertexShader:{log:X,prefix:y},fragmentShader:{log:$,prefix:g}})}s.deleteShader(S),s.deleteShader(P),x=new bo(s,m),w=ZM(s,m)}let x;this.getUniforms=function(){return x===void 0&&A(this),x};let w;this.getAttributes=function(){return w===void 0&&A(this),w};let F=t.rendererExtensionParallelShaderCompile===!1;return this.isReady=function(){return F===!1&&(F=s.getProgramParameter(m,BM)),F},this.destroy=function(){i.releaseStatesOfProgram(this),s.deleteProgram(m),this.program=void 0},this.type=t.shaderType,this.name=t.shaderName,this.id=zM++,this.cacheKey=e,this.usedTimes=1,this.program=m,this.vertexShader=S,this.fragmentShader=P,this}var aw=0,Qd=class{constructor(){this.shaderCache=new Map,this.materialCache=new Map}update(e,t,i){let s=this._getShaderCacheForMaterial(e);return s.has(t)===!1&&(s.add(t),t.usedTimes++),s.has(i)===!1&&(s.add(i),i.usedTimes++),this}remove(e){let t=this.materialCache.get(e);for(let i of t)i.usedTimes--,i.usedTimes===0&&this.shaderCache.delete(i.code);return this.materialCache.delete(e),this}getVertexShaderStage(e){return this._getShaderStage(e.vertexShader)}getFragmentShaderStage(e){return this._getShaderStage(e.fragmentShader)}dispose(){this.shaderCache.clear(),this.materialCache.clear()}_getShaderCacheForMaterial(e){let t=this.materialCache,i=t.get(e);return i===void 0&&(i=new Set,t.set(e,i)),i}_getShaderStage(e){let t=this.shaderCache,i=t.get(e);return i===void 0&&(i=new ef(e),t.set(e,i)),i}},ef=class{constructor(e){this.id=aw++,this.code=e,this.usedTimes=0}};function lw(n){return n===er||n===Ga||n===Ha}function cw(n,e,t,i,s,r){let o=new fa,a=new Qd,l=new Set,c=[],u=new Map,d=i.logarithmicDepthBuffer,h={MeshDepthMaterial:"depth",MeshDistanceMaterial:"distance",MeshNormalMaterial:"normal",MeshBasicMaterial:"basic",MeshLambertMaterial:"lambert",MeshPhongMaterial:"phong",MeshToonMaterial:"toon",MeshStandardMaterial:"physical",MeshPhysicalMaterial:"physical",MeshMatcapMaterial:"matcap",LineBasicMaterial:"basic",LineDashedMaterial:"dashed",PointsMaterial:"points",ShadowMaterial:"shadow",SpriteMaterial:"sprite"};function f(x){return l.add(x),x===0?"uv":`uv${x}`}function m(x,w,F,D,L,B){let V=D.fog,U=L.geometry,X=x.isMeshStandardMaterial||x.isMeshLambertMaterial||x.isMeshPhongMaterial?D.environment:null,$=x.isMeshStandardMaterial||x.isMeshLambertMaterial&&!x.envMap||x.isMeshPhongMaterial&&!x.envMap,W=e.get(x.envMap||X,$),ce=h[x.type],K=i.precision;x.precision!==null&&(K=i.getMaxPrecision(x.precision),K!==x.precision&&$e("WebGLProgram.getParameters:",x.precision,"not supported, using",K,"instead."));let Q=U.morphAttributes.position||U.morphAttributes.normal||U.morphAttributes.color,se=Q!==void 0?Q.length:0,de=0;U.morphAttributes.position!==void 0&&(de=1),U.morphAttributes.normal!==void 0&&(de=2),U.morphAttributes.color!==void 0&&(de=3);let he,ee,me,xe;if(ce){let Ce=rs[ce];he=Ce.vertexShader,ee=Ce.fragmentShader}else{he=x.vertexShader,ee=x.fragmentShader;let Ce=a.getVertexShaderStage(x),lt=a.getFragmentShaderStage(x);a.update(x,Ce,lt),me=Ce.id,xe=lt.id}let Ae=n.getRenderTarget(),Se=n.state.buffers.depth.getReversed(),We=L.isInstancedMesh===!0,ot=L.isBatchedMesh===!0,Ge=!!x.map,dt=!!x.matcap,ct=!!W,it=ct&&W.isPMREMTexture===!0,Zt=!!x.aoMap,Gt=!!x.lightMap,un=!!x.bumpMap&&x.wireframe===!1,Ut=!!x.normalMap,Cn=!!x.displacementMap,St=!!x.emissiveMap,vn=!!x.metalnessMap,tn=!!x.roughnessMap,hn=x.anisotropy>0,k=x.clearcoat>0,Re=x.diffuseRoughness>0,Ze=x.dispersion>0,at=x.retroreflectivity>0,Me=x.iridescence>0,Ft=x.sheen>0,Ve=x.transmission>0,Ye=hn&&!!x.anisotropyMap,R=k&&!!x.clearcoatMap,M=k&&!!x.clearcoatNormalMap,q=k&&!!x.clearcoatRoughnessMap,ue=Re&&!!x.diffuseRoughnessMap,oe=Me&&!!x.iridescenceMap,_e=Me&&!!x.iridescenceThicknessMap,ve=Ft&&!!x.sheenColorMap,te=Ft&&!!x.sheenRoughnessMap,ie=!!x.specularMap,pe=!!x.specularColorMap,O=!!x.specularIntensityMap,re=Ve&&!!x.transmissionMap,ne=Ve&&!!x.thicknessMap,we=!!x.gradientMap,ge=!!x.alphaMap,be=x.alphaTest>0,He=!!x.alphaHash,Ke=!!x.extensions,le=is;x.toneMapped&&(Ae===null||Ae.isXRRenderTarget===!0)&&(le=n.toneMapping);let ke=it?W.isCompressedCubeTexture?W.image[0].mipmaps:W.mipmaps:null,je={shaderID:ce,shaderType:x.type,shaderName:x.name,vertexShader:he,fragmentShader:ee,defines:x.defines,customVertexShaderID:me,customFragmentShaderID:xe,isRawShaderMaterial:x.isRawShaderMaterial===!0,glslVersion:x.glslVersion,precision:K,batching:ot,batchingColor:ot&&L._colorsTexture!==null,instancing:We,instancingColor:We&&L.instanceColor!==null,instancingMorph:We&&L.morphTexture!==null,outputColorSpace:Ae===null?n.outputColorSpace:Ae.isXRRenderTarget===!0?Ae.texture.colorSpace:yt.workingColorSpace,alphaToCoverage:!!x.alphaToCoverage,map:Ge,matcap:dt,envMap:ct,envMapMode:ct&&W.mapping,envMapPMREM:it,envMapMaxLod:it?ke.length-1:null,envMapSize:it?ke[0].width:null,aoMap:Zt,lightMap:Gt,bumpMap:un,normalMap:Ut,displacementMap:Cn,emissiveMap:St,normalMapObjectSpace:Ut&&x.normalMapType===sg,normalMapTangentSpace:Ut&&x.normalMapType===gu,packedNormalMap:Ut&&x.normalMapType===gu&&lw(x.normalMap.format),metalnessMap:vn,roughnessMap:tn,anisotropy:hn,anisotropyMap:Ye,clearcoat:k,clearcoatMap:R,clearcoatNormalMap:M,clearcoatRoughnessMap:q,diffuseRoughness:Re,diffuseRoughnessMap:ue,dispersion:Ze,retroreflection:at,iridescence:Me,iridescenceMap:oe,iridescenceThicknessMap:_e,sheen:Ft,sheenColorMap:ve,sheenRoughnessMap:te,specularMap:ie,specularColorMap:pe,specularIntensityMap:O,transmission:Ve,transmissionMap:re,thicknessMap:ne,gradientMap:we,opaque:x.transparent===!1&&x.blending===xo&&x.alphaToCoverage===!1,alphaMap:ge,alphaTest:be,alphaHash:He,combine:x.combine,mapUv:Ge&&f(x.map.channel),aoMapUv:Zt&&f(x.aoMap.channel),lightMapUv:Gt&&f(x.lightMap.channel),bumpMapUv:un&&f(x.bumpMap.channel),normalMapUv:Ut&&f(x.normalMap.channel),displacementMapUv:Cn&&f(x.displacementMap.channel),emissiveMapUv:St&&f(x.emissiveMap.channel),metalnessMapUv:vn&&f(x.metalnessMap.channel),roughnessMapUv:tn&&f(x.roughnessMap.channel),anisotropyMapUv:Ye&&f(x.anisotropyMap.channel),clearcoatMapUv:R&&f(x.clearcoatMap.channel),clearcoatNormalMapUv:M&&f(x.clearcoatNormalMap.channel),clearcoatRoughnessMapUv:q&&f(x.clearcoatRoughnessMap.channel),diffuseRoughnessMapUv:ue&&f(x.diffuseRoughnessMap.channel),iridescenceMapUv:oe&&f(x.iridescenceMap.channel),iridescenceThicknessMapUv:_e&&f(x.iridescenceThicknessMap.channel),sheenColorMapUv:ve&&f(x.sheenColorMap.channel),sheenRoughnessMapUv:te&&f(x.sheenRoughnessMap.channel),specularMapUv:ie&&f(x.specularMap.channel),specularColorMapUv:pe&&f(x.specularColorMap.channel),specularIntensityMapUv:O&&f(x.specularIntensityMap.channel),transmissionMapUv:re&&f(x.transmissionMap.channel),thicknessMapUv:ne&&f(x.thicknessMap.channel),alphaMapUv:ge&&f(x.alphaMap.channel),vertexTangents:!!U.attributes.tangent&&(Ut||hn),vertexNormals:!!U.attributes.normal,vertexColors:x.vertexColors,vertexAlphas:x.vertexColors===!0&&!!U.attributes.color&&U.attributes.color.itemSize===4,pointsUvs:L.isPoints===!0&&!!U.attributes.uv&&(Ge||ge),fog:!!V,useFog:x.fog===!0,fogExp2:!!V&&V.isFogExp2,flatShading:x.wireframe===!1&&(x.flatShading===!0||U.attributes.normal===void 0&&Ut===!1&&(x.isMeshLambertMaterial||x.isMeshPhongMaterial||x.isMeshStandardMaterial||x.isMeshPhysicalMaterial)),sizeAttenuation:x.sizeAttenuation===!0,logarithmicDepthBuffer:d,reversedDepthBuffer:Se,skinning:L.isSkinnedMesh===!0,hasPositionAttribute:U.attributes.position!==void 0,morphTargets:U.morphAttributes.position!==void 0,morphNormals:U.morphAttributes.normal!==void 0,morphColors:U.morphAttributes.color!==void 0,morphTargetsCount:se,morphTextureStride:de,numSunLights:w.sun.length,numDirLights:w.directional.length,numPointLights:w.point.length,numSpotLights:w.spot.length,numSpotLightMaps:w.spotLightMap.length,numRectAreaLights:w.rectArea.length,numHemiLights:w.hemi.length,numSunLightShadows:w.sunShadowMap.length,numDirLightShadows:w.directionalShadowMap.length,numPointLightShadows:w.pointShadowMap.length,numSpotLightShadows:w.spotShadowMap.length,numSpotLightShadowsWithMaps:w.numSpotLightShadowsWithMaps,numLightProbes:w.numLightProbes,numLightProbeGrids:B.filter(Ce=>Ce.texture!==null).length,numClippingPlanes:r.numPlanes,numClipIntersection:r.numIntersection,dithering:x.dithering,shadowMapEnabled:n.shadowMap.enabled&&F.length>0,shadowMapType:n.shadowMap.type,toneMapping:le,decodeVideoTexture:Ge&&x.map.isVideoTexture===!0&&yt.getTransfer(x.map.colorSpace)===Rt,decodeVideoTextureEmissive:St&&x.emissiveMap.isVideoTexture===!0&&yt.getTransfer(x.emissiveMap.colorSpace)===Rt,premultipliedAlpha:x.premultipliedAlpha,doubleSided:x.side===ns,flipSided:x.side===ti,useDepthPacking:x.depthPacking>=0,depthPacking:x.depthPacking||0,index0AttributeName:x.index0AttributeName,extensionClipCullDistance:Ke&&x.extensions.clipCullDistance===!0&&t.has("WEBGL_clip_cull_distance"),extensionMultiDraw:(Ke&&x.extensions.multiDraw===!0||ot)&&t.has("WEBGL_multi_draw"),rendererExtensionParallelShaderCompile:t.has("KHR_parallel_shader_compile"),customProgramCacheKey:x.customProgramCacheKey()};return je.vertexUv1s=l.has(1),je.vertexUv2s=l.has(2),je.vertexUv3s=l.has(3),l.clear(),je}function y(x){let w=[];if(x.shaderID?w.push(x.shaderID):(w.push(x.customVertexShaderID),w.push(x.customFragmentShaderID)),x.defines!==void 0)for(let F in x.defines)w.push(F),w.push(x.defines[F]);return x.isRawShaderMaterial===!1&&(g(w,x),_(w,x),w.push(n.outputColorSpace)),w.push(x.customProgramCacheKey),w.join()}function g(x,w){x.push(w.precision),x.push(w.outputColorSpace),x.push(w.envMapMode),x.push(w.envMapPMREM),x.push(w.envMapMaxLod),x.push(w.envMapSize),x.push(w.mapUv),x.push(w.alphaMapUv),x.push(w.lightMapUv),x.push(w.aoMapUv),x.push(w.bumpMapUv),x.push(w.normalMapUv),x.push(w.displacementMapUv),x.push(w.emissiveMapUv),x.push(w.metalnessMapUv),x.push(w.roughnessMapUv),x.push(w.anisotropyMapUv),x.push(w.clearcoatMapUv),x.push(w.clearcoatNormalMapUv),x.push(w.clearcoatRoughnessMapUv),x.push(w.diffuseRoughnessMapUv),x.push(w.iridescenceMapUv),x.push(w.iridescenceThicknessMapUv),x.push(w.sheenColorMapUv),x.push(w.sheenRoughnessMapUv),x.push(w.specularMapUv),x.push(w.specularColorMapUv),x.push(w.specularIntensityMapUv),x.push(w.transmissionMapUv),x.push(w.thicknessMapUv),x.push(w.combine),x.push(w.fogExp2),x.push(w.sizeAttenuation),x.push(w.morphTargetsCount),x.push(w.numSunLights),x.push(w.numDirLights),x.push(w.numPointLights),x.push(w.numSpotLights),x.push(w.numSpotLightMaps),x.push(w.numHemiLights),x.push(w.numRectAreaLights),x.push(w.numSunLightShadows),x.push(w.numDirLightShadows),x.push(w.numPointLightShadows),x.push(w.numSpotLightShadows),x.push(w.numSpotLightShadowsWithMaps),x.push(w.numLightProbes),x.push(w.numLightProbeGrids),x.push(w.shadowMapType),x.push(w.toneMapping),x.push(w.numClippingPlanes),x.push(w.numClipIntersection),x.push(w.depthPacking)}function _(x,w){o.disableAll(),w.instancing&&o.enable(0),w.instancingColor&&o.enable(1),w.instancingMorph&&o.enable(2),w.matcap&&o.enable(3),w.envMap&&o.enable(4),w.normalMapObjectSpace&&o.enable(5),w.normalMapTangentSpace&&o.enable(6),w.clearcoat&&o.enable(7),w.iridescence&&o.enable(8),w.alphaTest&&o.enable(9),w.vertexColors&&o.enable(10),w.vertexAlphas&&o.enable(11),w.vertexUv1s&&o.enable(12),w.vertexUv2s&&o.enable(13),w.vertexUv3s&&o.enable(14),w.vertexTangents&&o.enable(15),w.anisotropy&&o.enable(16),w.alphaHash&&o.enable(17),w.batching&&o.enable(18),w.dispersion&&o.enable(19),w.retroreflection&&o.enable(24),w.diffuseRoughness&&o.enable(25),w.batchingColor&&o.enable(20),w.gradientMap&&o.enable(21),w.packedNormalMap&&o.enable(22),w.vertexNormals&&o.enable(23),x.push(o.mask),o.disableAll(),w.fog&&o.enable(0),w.useFog&&o.enable(1),w.flatShading&&o.enable(2),w.logarithmicDepthBuffer&&o.enable(3),w.reversedDepthBuffer&&o.enable(4),w.skinning&&o.enable(5),w.morphTargets&&o.enable(6),w.morphNormals&&o.enable(7),w.morphColors&&o.enable(8),w.premultipliedAlpha&&o.enable(9),w.shadowMapEnabled&&o.enable(10),w.doubleSided&&o.enable(11),w.flipSided&&o.enable(12),w.useDepthPacking&&o.enable(13),w.dithering&&o.enable(14),w.transmission&&o.enable(15),w.sheen&&o.enable(16),w.opaque&&o.enable(17),w.pointsUvs&&o.enable(18),w.decodeVideoTexture&&o.enable(19),w.decodeVideoTextureEmissive&&o.enable(20),w.alphaToCoverage&&o.enable(21),w.numLightProbeGrids>0&&o.enable(22),w.hasPositionAttribute&&o.enable(23),x.push(o.mask)}function b(x){let w=h[x.type],F;if(w){let D=rs[w];F=_g.clone(D.uniforms)}else F=x.uniforms;return F}function C(x,w){let F=u.get(w);return F!==void 0?++F.usedTimes:(F=new ow(n,w,x,s),c.push(F),u.set(w,F)),F}function S(x){if(--x.usedTimes===0){let w=c.indexOf(x);c[w]=c[c.length-1],c.pop(),u.delete(x.cacheKey),x.destroy()}}function P(x){a.remove(x)}function A(){a.dispose()}return{getParameters:m,getProgramCacheKey:y,getUniforms:b,acquireProgram:C,releaseProgram:S,releaseShaderCache:P,programs:c,dispose:A}}function uw(){let n=new WeakMap;function e(o){return n.has(o)}function t(o){let a=n.get(o);return a===void 0&&(a={},n.set(o,a)),a}function i(o){n.delete(o)}function s(o,a,l){n.get(o)[a]=l}function r(){n=new WeakMap}return{has:e,get:t,remove:i,update:s,dispose:r}}function hw(n,e){return n.groupOrder!==e.groupOrder?n.groupOrder-e.groupOrder:n.renderOrder!==e.renderOrder?n.renderOrder-e.renderOrder:n.material.id!==e.material.id?n.material.id-e.material.id:n.materialVariant!==e.materialVariant?n.materialVariant-e.materialVariant:n.z!==e.z?n.z-e.z:n.id-e.id}function Fg(n,e){return n.groupOrder!==e.groupOrder?n.groupOrder-e.groupOrder:n.renderOrder!==e.renderOrder?n.renderOrder-e.renderOrder:n.z!==e.z?e.z-n.z:n.id-e.id}function kg(){let n=[],e=0,t=[],i=[],s=[];function r(){e=0,t.length=0,i.length=0,s.length=0}function o(h){let f=0;return h.isInstancedMesh&&(f+=2),h.isSkinnedMesh&&(f+=1),f}function a(h,f,m,y,g,_){let b=n[e];return b===void 0?(b={id:h.id,object:h,geometry:f,material:m,materialVariant:o(h),groupOrder:y,renderOrder:h.renderOrder,z:g,group:_},n[e]=b):(b.id=h.id,b.object=h,b.geometry=f,b.material=m,b.materialVariant=o(h),b.groupOrder=y,b.renderOrder=h.renderOrder,b.z=g,b.group=_),e++,b}function l(h,f,m,y,g,_,b){b.reversedDepth===!0&&(g=-g);let C=a(h,f,m,y,g,_);m.transmission>0?i.push(C):m.transparent===!0?s.push(C):t.push(C)}function c(h,f,m,y,g,_){let b=a(h,f,m,y,g,_);m.transmission>0?i.unshift(b):m.transparent===!0?s.unshift(b):t.unshift(b)}function u(h,f){t.length>1&&t.sort(h||hw),i.length>1&&i.sort(f||Fg),s.length>1&&s.sort(f||Fg)}function d(){for(let h=e,f=n.length;h<f;h++){let m=n[h];if(m.id===null)break;m.id=null,m.object=null,m.geometry=null,m.material=null,m.group=null}}return{opaque:t,transmissive:i,transparent:s,init:r,push:l,unshift:c,finish:d,sort:u}}function dw(){let n=new WeakMap;function e(i,s){let r=n.get(i),o;return r===void 0?(o=new kg,n.set(i,[o])):s>=r.length?(o=new kg,r.push(o)):o=r[s],o}function t(){n=new WeakMap}return{get:e,dispose:t}}function fw(){let n={};return{get:function(e){if(n[e.id]!==void 0)return n[e.id];let t;switch(e.type){case"SunLight":case"DirectionalLight":t={direction:new H,color:new tt};break;case"SpotLight":t={position:new H,direction:new H,color:new tt,distance:0,coneCos:0,penumbraCos:0,decay:0};break;case"PointLight":t={position:new H,color:new tt,distance:0,decay:0};break;case"HemisphereLight":t={direction:new H,skyColor:new tt,groundColor:new tt};break;case"RectAreaLight":t={color:new tt,position:new H,halfWidth:new H,halfHeight:new H};break}return n[e.id]=t,t}}}function pw(){let n={};return{get:function(e){if(n[e.id]!==void 0)return n[e.id];let t;switch(e.type){case"SunLight":case"DirectionalLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new qe};break;case"SpotLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new qe};break;case"PointLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new qe,shadowCameraNear:1,shadowCameraFar:1e3};break}return n[e.id]=t,t}}}var mw=0;function gw(n,e){return(e.castShadow?2:0)-(n.castShadow?2:0)+(e.map?1:0)-(n.map?1:0)}function _w(n){let e=new fw,t=pw(),i={version:0,hash:{sunLength:-1,directionalLength:-1,pointLength:-1,spotLength:-1,rectAreaLength:-1,hemiLength:-1,numSunShadows:-1,numDirectionalShadows:-1,numPointShadows:-1,numSpotShadows:-1,numSpotMaps:-1,numLightProbes:-1},ambient:[0,0,0],probe:[],sun:[],sunShadow:[],sunShadowMap:[],sunShadowMatrix:[],sunShadowCascade:[],directional:[],directionalShadow:[],directionalShadowMap:[],directionalShadowMatrix:[],spot:[],spotLightMap:[],spotShadow:[],spotShadowMap:[],spotLightMatrix:[],rectArea:[],rectAreaLTC1:null,rectAreaLTC2:null,point:[],pointShadow:[],pointShadowMap:[],pointShadowMatrix:[],hemi:[],numSpotLightShadowsWithMaps:0,numLightProbes:0};for(let c=0;c<9;c++)i.probe.push(new H);let s=new H,r=new Bt,o=new Bt;function a(c){let u=0,d=0,h=0;for(let B=0;B<9;B++)i.probe[B].set(0,0,0);let f=0,m=0,y=0,g=0,_=0,b=0,C=0,S=0,P=0,A=0,x=0,w=0,F=0,D=0;c.sort(gw);for(let B=0,V=c.length;B<V;B++){let U=c[B],X=U.color,$=U.intensity,W=U.distance,ce=null;if(U.shadow&&U.shadow.map&&(U.shadow.map.texture.format===er?ce=U.shadow.map.texture:ce=U.shadow.map.depthTexture||U.shadow.map.texture),U.isAmbientLight)u+=X.r*$,d+=X.g*$,h+=X.b*$;else if(U.isLightProbe){for(let K=0;K<9;K++)i.probe[K].addScaledVector(U.sh.coefficients[K],$);D++}else if(U.isSunLight){let K=e.get(U);if(K.color.copy(U.color).multiplyScalar(U.intensity),U.castShadow){let Q=U.shadow,se=t.get(U);se.shadowIntensity=Q.intensity,se.shadowBias=Q.bias,se.shadowNormalBias=Q.normalBias,se.shadowRadius=Q.radius,se.shadowMapSize.copy(Q.mapSize).multiply(Q.getFrameExtents()),i.sunShadow[m]=se,i.sunShadowMap[m]=ce;let de=Q.getViewportCount();for(let he=0;he<de;he++)i.sunShadowMatrix[y+he]=Q.getMatrix(he),i.sunShadowCascade[y+he]=Q._cascadeData[he];y+=de,m++}i.sun[f]=K,f++}else if(U.isDirectionalLight){let K=e.get(U);if(K.color.copy(U.color).multiplyScalar(U.intensity),U.castShadow){let Q=U.shadow,se=t.get(U);se.shadowIntensity=Q.intensity,se.shadowBias=Q.bias,se.shadowNormalBias=Q.normalBias,se.shadowRadius=Q.radius,se.shadowMapSize=Q.mapSize,i.directionalShadow[g]=se,i.directionalShadowMap[g]=ce,i.directionalShadowMatrix[g]=U.shadow.matrix,P++}i.directional[g]=K,g++}else if(U.isSpotLight){let K=e.get(U);K.position.setFromMatrixPosition(U.matrixWorld),K.color.copy(X).multiplyScalar($),K.distance=W,K.coneCos=Math.cos(U.angle),K.penumbraCos=Math.cos(U.angle*(1-U.penumbra)),K.decay=U.decay,i.spot[b]=K;let Q=U.shadow;if(U.map&&(i.spotLightMap[w]=U.map,w++,Q.updateMatrices(U),U.castShadow&&F++),i.spotLightMatrix[b]=Q.matrix,U.castShadow){let se=t.get(U);se.shadowIntensity=Q.intensity,se.shadowBias=Q.bias,se.shadowNormalBias=Q.normalBias,se.shadowRadius=Q.radius,se.shadowMapSize=Q.mapSize,i.spotShadow[b]=se,i.spotShadowMap[b]=ce,x++}b++}else if(U.isRectAreaLight){let K=e.get(U);K.color.copy(X).multiplyScalar($),K.halfWidth.set(U.width*.5,0,0),K.halfHeight.set(0,U.height*.5,0),i.rectArea[C]=K,C++}else if(U.isPointLight){let K=e.get(U);if(K.color.copy(U.color).multiplyScalar(U.intensity),K.distance=U.distance,K.decay=U.decay,U.castShadow){let Q=U.shadow,se=t.get(U);se.shadowIntensity=Q.intensity,se.shadowBias=Q.bias,se.shadowNormalBias=Q.normalBias,se.shadowRadius=Q.radius,se.shadowMapSize=Q.mapSize,se.shadowCameraNear=Q.camera.near,se.shadowCameraFar=Q.camera.far,i.pointShadow[_]=se,i.pointShadowMap[_]=ce,i.pointShadowMatrix[_]=U.shadow.matrix,A++}i.point[_]=K,_++}else if(U.isHemisphereLight){let K=e.get(U);K.skyColor.copy(U.color).multiplyScalar($),K.groundColor.copy(U.groundColor).multiplyScalar($),i.hemi[S]=K,S++}}C>0&&(n.has("OES_texture_float_linear")===!0?(i.rectAreaLTC1=Le.LTC_FLOAT_1,i.rectAreaLTC2=Le.LTC_FLOAT_2):(i.rectAreaLTC1=Le.LTC_HALF_1,i.rectAreaLTC2=Le.LTC_HALF_2)),i.ambient[0]=u,i.ambient[1]=d,i.ambient[2]=h;let L=i.hash;(L.sunLength!==f||L.directionalLength!==g||L.pointLength!==_||L.spotLength!==b||L.rectAreaLength!==C||L.hemiLength!==S||L.numSunShadows!==m||L.numDirectionalShadows!==P||L.numPointShadows!==A||L.numSpotShadows!==x||L.numSpotMaps!==w||L.numLightProbes!==D)&&(i.sun.length=f,i.directional.length=g,i.spot.length=b,i.rectArea.length=C,i.point.length=_,i.hemi.length=S,i.sunShadow.length=m,i.sunShadowMap.length=m,i.sunShadowMatrix.length=y,i.sunShadowCascade.length=y,i.directionalShadow.length=P,i.directionalShadowMap.length=P,i.directionalShadowMatrix.length=P,i.pointShadow.length=A,i.pointShadowMap.length=A,i.pointShadowMatrix.length=A,i.spotShadow.length=x,i.spotShadowMap.length=x,i.spotLightMatrix.length=x+w-F,i.spotLightMap.length=w,i.numSpotLightShadowsWithMaps=F,i.numLightProbes=D,L.sunLength=f,L.directionalLength=g,L.pointLength=_,L.spotLength=b,L.rectAreaLength=C,L.hemiLength=S,L.numSunShadows=m,L.numDirectionalShadows=P,L.numPointShadows=A,L.numSpotShadows=x,L.numSpotMaps=w,L.numLightProbes=D,i.version=mw++)}function l(c,u){let d=0,h=0,f=0,m=0,y=0,g=0,_=u.matrixWorldInverse;for(let b=0,C=c.length;b<C;b++){let S=c[b];if(S.isSunLight){let P=i.sun[d];P.direction.setFromMatrixPosition(S.matrixWorld),P.direction.transformDirection(_),d++}else if(S.isDirectionalLight){let P=i.directional[h];P.direction.setFromMatrixPosition(S.matrixWorld),s.setFromMatrixPosition(S.target.matrixWorld),P.direction.sub(s),P.direction.transformDirection(_),h++}else if(S.isSpotLight){let P=i.spot[m];P.position.setFromMatrixPosition(S.matrixWorld),P.position.applyMatrix4(_),P.direction.setFromMatrixPosition(S.matrixWorld),s.setFromMatrixPosition(S.target.matrixWorld),P.direction.sub(s),P.direction.transformDirection(_),m++}else if(S.isRectAreaLight){let P=i.rectArea[y];P.position.setFromMatrixPosition(S.matrixWorld),P.position.applyMatrix4(_),o.identity(),r.copy(S.matrixWorld),r.premultiply(_),o.extractRotation(r),P.halfWidth.set(S.width*.5,0,0),P.halfHeight.set(0,S.height*.5,0),P.halfWidth.applyMatrix4(o),P.halfHeight.applyMatrix4(o),y++}else if(S.isPointLight){let P=i.point[f];P.position.setFromMatrixPosition(S.matrixWorld),P.position.applyMatrix4(_),f++}else if(S.isHemisphereLight){let P=i.hemi[g];P.direction.setFromMatrixPosition(S.matrixWorld),P.direction.transformDirection(_),g++}}}return{setup:a,setupView:l,state:i}}function Bg(n){let e=new _w(n),t=[],i=[],s=[];function r(d){u.camera=d,t.length=0,i.length=0,s.length=0}function o(d){d.isLightProbeGrid?s.push(d):t.push(d)}function a(d){i.push(d)}function l(){e.setup(t),s.sort((d,h)=>d.priority-h.priority||d.id-h.id)}function c(d){e.setupView(t,d)}let u={lightsArray:t,shadowsArray:i,lightProbeGridArray:s,camera:null,lights:e,transmissionRenderTarget:{},textureUnits:0};return{init:r,state:u,setupLights:l,setupLightsView:c,pushLight:o,pushShadow:a}}function xw(n){let e=new WeakMap;function t(s,r=0){let o=e.get(s),a;return o===void 0?(a=new Bg(n),e.set(s,[a])):r>=o.length?(a=new Bg(n),o.push(a)):a=o[r],a}function i(){e=new WeakMap}return{get:t,dispose:i}}var vw=`void main() {
	gl_Position = vec4( position, 1.0 );
}`,yw=`uniform sampler2D shadow_pass;
uniform vec2 resolution;
uniform float radius;
void main() {
	const float samples = float( VSM_SAMPLES );
	float mean = 0.0;
	float squared_mean = 0.0;
	float uvStride = samples <= 1.0 ? 0.0 : 2.0 / ( samples - 1.0 );
	float uvStart = samples <= 1.0 ? 0.0 : - 1.0;
	for ( float i = 0.0; i < samples; i ++ ) {
		float uvOffset = uvStart + i * uvStride;
		#ifdef HORIZONTAL_PASS
			vec2 distribution = texture2D( shadow_pass, ( gl_FragCoord.xy + vec2( uvOffset, 0.0 ) * radius ) / resolution ).rg;
			mean += distribution.x;
			squared_mean += distribution.y * distribution.y + distribution.x * distribution.x;
		#else
			float depth = texture2D( shadow_pass, ( gl_FragCoord.xy + vec2( 0.0, uvOffset ) * radius ) / resolution ).r;
			mean += depth;
			squared_mean += depth * depth;
		#endif
	}
	mean = mean / samples;
	squared_mean = squared_mean / samples;
	float std_dev = sqrt( max( 0.0, squared_mean - mean * mean ) );
	gl_FragColor = vec4( mean, std_dev, 0.0, 1.0 );
}`,bw=[new H(1,0,0),new H(-1,0,0),new H(0,1,0),new H(0,-1,0),new H(0,0,1),new H(0,0,-1)],Sw=[new H(0,-1,0),new H(0,-1,0),new H(0,0,1),new H(0,0,-1),new H(0,-1,0),new H(0,-1,0)],zg=new Bt,Wa=new H,$d=new H;function Mw(n,e,t){let i=new Ys,s=new qe,r=new qe,o=new jt,a=new _c,l=new xc,c={},u=t.maxTextureSize,d={[Qs]:ti,[ti]:Qs,[ns]:ns},h=new ts({defines:{VSM_SAMPLES:8},uniforms:{shadow_pass:{value:null},resolution:{value:new qe},radius:{value:4}},vertexShader:vw,fragmentShader:yw}),f=h.clone();f.defines.HORIZONTAL_PASS=1;let m=new Bn;m.setAttribute("position",new Ni(new Float32Array([-1,-1,.5,3,-1,.5,-1,3,.5]),3));let y=new ri(m,h),g=this;this.enabled=!1,this.autoUpdate=!0,this.needsUpdate=!1,this.type=Oa;let _=this.type;this.render=function(A,x,w){if(g.enabled===!1||g.autoUpdate===!1&&g.needsUpdate===!1||A.length===0)return;this.type===Um&&($e("WebGLShadowMap: PCFSoftShadowMap has been removed. Using PCFShadowMap instead."),this.type=Oa);let F=n.getRenderTarget(),D=n.getActiveCubeFace(),L=n.getActiveMipmapLevel(),B=n.state;B.setBlending(pr),B.buffers.depth.getReversed()===!0?B.buffers.color.setClear(0,0,0,0):B.buffers.color.setClear(1,1,1,1),B.buffers.depth.setTest(!0),B.setScissorTest(!1);let V=_!==this.type;V&&x.traverse(function(U){U.material&&(Array.isArray(U.material)?U.material.forEach(X=>X.needsUpdate=!0):U.material.needsUpdate=!0)});for(let U=0,X=A.length;U<X;U++){let $=A[U],W=$.shadow;if(W===void 0){$e("WebGLShadowMap:",$,"has no shadow.");continue}if(W.autoUpdate===!1&&W.needsUpdate===!1)continue;s.copy(W.mapSize);let ce=W.getFrameExtents();s.multiply(ce),r.copy(W.mapSize),(s.x>u||s.y>u)&&(s.x>u&&(r.x=Math.floor(u/ce.x),s.x=r.x*ce.x,W.mapSize.x=r.x),s.y>u&&(r.y=Math.floor(u/ce.y),s.y=r.y*ce.y,W.mapSize.y=r.y));let K=n.state.buffers.depth.getReversed();if(W.camera._reversedDepth=K,W.map===null||V===!0){if(W.map!==null&&(W.map.depthTexture!==null&&(W.map.depthTexture.dispose(),W.map.depthTexture=null),W.map.dispose()),this.type===_o){if($.isPointLight){$e("WebGLShadowMap: VSM shadow maps are not supported for PointLights. Use PCF or BasicShadowMap instead.");continue}W.map=new mi(s.x,s.y,{format:er,type:Bi,minFilter:Qn,magFilter:Qn,generateMipmaps:!1}),W.map.texture.name=$.name+".shadowMap",W.map.depthTexture=new ws(s.x,s.y,ki),W.map.depthTexture.name=$.name+".shadowMapDepth",W.map.depthTexture.format=Ss,W.map.depthTexture.compareFunction=null,W.map.depthTexture.minFilter=Nn,W.map.depthTexture.magFilter=Nn}else $.isPointLight?(W.map=new qa(s.x),W.map.depthTexture=new Sa(s.x,Fi)):(W.map=new mi(s.x,s.y),W.map.depthTexture=new ws(s.x,s.y,Fi)),W.map.depthTexture.name=$.name+".shadowMap",W.map.depthTexture.format=Ss,this.type===Oa?(W.map.depthTexture.compareFunction=K?Nd:Dd,W.map.depthTexture.minFilter=Qn,W.map.depthTexture.magFilter=Qn):(W.map.depthTexture.compareFunction=null,W.map.depthTexture.minFilter=Nn,W.map.depthTexture.magFilter=Nn);W.camera.updateProjectionMatrix()}W.map.isWebGLCubeRenderTarget!==!0&&(W.map.width!==s.x||W.map.height!==s.y)&&W.map.setSize(s.x,s.y);let Q=W.map.isWebGLCubeRenderTarget?6:W.getViewportCount();$.isPointLight!==!0&&W.updateMatrices($,w);let se=(W.camera.layers.mask&4294967294)!==0?W.camera.layers:w.layers;for(let de=0;de<Q;de++){let he=W.getCamera(de);if($.isPointLight){let ee=W.camera,me=W.matrix,xe=$.distance||ee.far;xe!==ee.far&&(ee.far=xe,ee.updateProjectionMatrix()),Wa.setFromMatrixPosition($.matrixWorld),ee.position.copy(Wa),$d.copy(ee.position),$d.add(bw[de]),ee.up.copy(Sw[de]),ee.lookAt($d),ee.updateMatrixWorld(),me.makeTranslation(-Wa.x,-Wa.y,-Wa.z),zg.multiplyMatrices(ee.projectionMatrix,ee.matrixWorldInverse),W._frustum.setFromProjectionMatrix(zg,ee.coordinateSystem,ee.reversedDepth)}if(W.map.isWebGLCubeRenderTarget)n.setRenderTarget(W.map,de),n.clear();else{de===0&&(n.setRenderTarget(W.map),n.clear());let ee=W.getViewport(de);o.set(r.x*ee.x,r.y*ee.y,r.x*ee.z,r.y*ee.w),B.viewport(o)}i=W.getFrustum(de),S(x,w,he,$,se,this.type)}W.isPointLightShadow!==!0&&this.type===_o&&b(W,w),W.needsUpdate=!1}_=this.type,g.needsUpdate=!1,n.setRenderTarget(F,D,L)};function b(A,x){let w=e.update(y);h.defines.VSM_SAMPLES!==A.blurSamples&&(h.defines.VSM_SAMPLES=A.blurSamples,f.defines.VSM_SAMPLES=A.blurSamples,h.needsUpdate=!0,f.needsUpdate=!0),A.mapPass===null?A.mapPass=new mi(s.x,s.y,{format:er,type:Bi}):(A.mapPass.width!==A.map.width||A.mapPass.height!==A.map.height)&&A.mapPass.setSize(A.map.width,A.map.height),h.uniforms.shadow_pass.value=A.map.depthTexture,h.uniforms.resolution.value.set(A.map.width,A.map.height),h.uniforms.radius.value=A.radius,n.setRenderTarget(A.mapPass),n.clear(),n.renderBufferDirect(x,null,w,h,y,null),f.uniforms.shadow_pass.value=A.mapPass.texture,f.uniforms.resolution.value.set(A.map.width,A.map.height),f.uniforms.radius.value=A.radius,n.setRenderTarget(A.map),n.clear(),n.renderBufferDirect(x,null,w,f,y,null)}function C(A,x,w,F){let D=null,L=w.isPointLight===!0?A.customDistanceMaterial:A.customDepthMaterial;if(L!==void 0)D=L;else if(D=w.isPointLight===!0?l:a,n.localClippingEnabled&&x.clipShadows===!0&&Array.isArray(x.clippingPlanes)&&x.clippingPlanes.length!==0||x.displacementMap&&x.displacementScale!==0||x.alphaMap&&x.alphaTest>0||x.map&&x.alphaTest>0||x.alphaToCoverage===!0){let B=D.uuid,V=x.uuid,U=c[B];U===void 0&&(U={},c[B]=U);let X=U[V];X===void 0&&(X=D.clone(),U[V]=X,x.addEventListener("dispose",P)),D=X}if(D.visible=x.visible,D.wireframe=x.wireframe,F===_o?D.side=x.shadowSide!==null?x.shadowSide:x.side:D.side=x.shadowSide!==null?x.shadowSide:d[x.side],D.alphaMap=x.alphaMap,D.alphaTest=x.alphaToCoverage===!0?.5:x.alphaTest,D.map=x.map,D.clipShadows=x.clipShadows,D.clippingPlanes=x.clippingPlanes,D.clipIntersection=x.clipIntersection,D.displacementMap=x.displacementMap,D.displacementScale=x.displacementScale,D.displacementBias=x.displacementBias,D.wireframeLinewidth=x.wireframeLinewidth,D.linewidth=x.linewidth,w.isPointLight===!0&&D.isMeshDistanceMaterial===!0){let B=n.properties.get(D);B.light=w}return D}function S(A,x,w,F,D,L){if(A.visible===!1)return;if(A.layers.test(D)&&(A.isMesh||A.isLine||A.isPoints)&&(A.castShadow||A.receiveShadow&&L===_o)&&(!A.frustumCulled||A.intersectsFrustum(i))){A.modelViewMatrix.multiplyMatrices(w.matrixWorldInverse,A.matrixWorld);let U=e.update(A),X=A.material;if(Array.isArray(X)){let $=U.groups;for(let W=0,ce=$.length;W<ce;W++){let K=$[W],Q=X[K.materialIndex];if(Q&&Q.visible){let se=C(A,Q,F,L);A.onBeforeShadow(n,A,x,w,U,se,K),n.renderBufferDirect(w,null,U,se,A,K),A.onAfterShadow(n,A,x,w,U,se,K)}}}else if(X.visible){let $=C(A,X,F,L);A.onBeforeShadow(n,A,x,w,U,$,null),n.renderBufferDirect(w,null,U,$,A,null),A.onAfterShadow(n,A,x,w,U,$,null)}}let V=A.children;for(let U=0,X=V.length;U<X;U++)S(V[U],x,w,F,D,L)}function P(A){A.target.removeEventListener("dispose",P);for(let w in c){let F=c[w],D=A.target.uuid;D in F&&(F[D].dispose(),delete F[D])}}}function ww(n,e){function t(){let O=!1,re=new jt,ne=null,we=new jt(0,0,0,0);return{setMask:function(ge){ne!==ge&&!O&&(n.colorMask(ge,ge,ge,ge),ne=ge)},setLocked:function(ge){O=ge},setClear:function(ge,be,He,Ke,le){le===!0&&(ge*=Ke,be*=Ke,He*=Ke),re.set(ge,be,He,Ke),we.equals(re)===!1&&(n.clearColor(ge,be,He,Ke),we.copy(re))},reset:function(){O=!1,ne=null,we.set(-1,0,0,0)}}}function i(){let O=!1,re=!1,ne=null,we=null,ge=null;return{setReversed:function(be){if(re!==be){let He=e.get("EXT_clip_control");be?He.clipControlEXT(He.LOWER_LEFT_EXT,He.ZERO_TO_ONE_EXT):He.clipControlEXT(He.LOWER_LEFT_EXT,He.NEGATIVE_ONE_TO_ONE_EXT),re=be;let Ke=ge;ge=null,this.setClear(Ke)}},getReversed:function(){return re},setTest:function(be){be?Se(n.DEPTH_TEST):We(n.DEPTH_TEST)},setMask:function(be){ne!==be&&!O&&(n.depthMask(be),ne=be)},setFunc:function(be){if(re&&(be=pg[be]),we!==be){switch(be){case Kl:n.depthFunc(n.NEVER);break;case jl:n.depthFunc(n.ALWAYS);break;case Ql:n.depthFunc(n.LESS);break;case no:n.depthFunc(n.LEQUAL);break;case ec:n.depthFunc(n.EQUAL);break;case tc:n.depthFunc(n.GEQUAL);break;case nc:n.depthFunc(n.GREATER);break;case ic:n.depthFunc(n.NOTEQUAL);break;default:n.depthFunc(n.LEQUAL)}we=be}},setLocked:function(be){O=be},setClear:function(be){ge!==be&&(ge=be,re&&(be=1-be),n.clearDepth(be))},reset:function(){O=!1,ne=null,we=null,ge=null,re=!1}}}function s(){let O=!1,re=null,ne=null,we=null,ge=null,be=null,He=null,Ke=null,le=null;return{setTest:function(ke){O||(ke?Se(n.STENCIL_TEST):We(n.STENCIL_TEST))},setMask:function(ke){re!==ke&&!O&&(n.stencilMask(ke),re=ke)},setFunc:function(ke,je,Ce){(ne!==ke||we!==je||ge!==Ce)&&(n.stencilFunc(ke,je,Ce),ne=ke,we=je,ge=Ce)},setOp:function(ke,je,Ce){(be!==ke||He!==je||Ke!==Ce)&&(n.stencilOp(ke,je,Ce),be=ke,He=je,Ke=Ce)},setLocked:function(ke){O=ke},setClear:function(ke){le!==ke&&(n.clearStencil(ke),le=ke)},reset:function(){O=!1,re=null,ne=null,we=null,ge=null,be=null,He=null,Ke=null,le=null}}}let r=new t,o=new i,a=new s,l={},c=new WeakMap,u={},d={},h={},f=new WeakMap,m=[],y=null,g=!1,_=null,b=null,C=null,S=null,P=null,A=null,x=null,w=new tt(0,0,0),F=0,D=!1,L=null,B=null,V=null,U=null,X=null,$=n.getParameter(n.MAX_COMBINED_TEXTURE_IMAGE_UNITS),W=!1,ce=0,K=n.getParameter(n.VERSION);K.indexOf("WebGL")!==-1?(ce=parseFloat(/^WebGL (\d)/.exec(K)[1]),W=ce>=1):K.indexOf("OpenGL ES")!==-1&&(ce=parseFloat(/^OpenGL ES (\d)/.exec(K)[1]),W=ce>=2);let Q=null,se={},de=n.getParameter(n.SCISSOR_BOX),he=n.getParameter(n.VIEWPORT),ee=new jt().fromArray(de),me=new jt().fromArray(he);function xe(O,re,ne,we){let ge=new Uint8Array(4),be=n.createTexture();n.bindTexture(O,be),n.texParameteri(O,n.TEXTURE_MIN_FILTER,n.NEAREST),n.texParameteri(O,n.TEXTURE_MAG_FILTER,n.NEAREST);for(let He=0;He<ne;He++)O===n.TEXTURE_3D||O===n.TEXTURE_2D_ARRAY?n.texImage3D(re,0,n.RGBA,1,1,we,0,n.RGBA,n.UNSIGNED_BYTE,ge):n.texImage2D(re+He,0,n.RGBA,1,1,0,n.RGBA,n.UNSIGNED_BYTE,ge);return be}let Ae={};Ae[n.TEXTURE_2D]=xe(n.TEXTURE_2D,n.TEXTURE_2D,1),Ae[n.TEXTURE_CUBE_MAP]=xe(n.TEXTURE_CUBE_MAP,n.TEXTURE_CUBE_MAP_POSITIVE_X,6),Ae[n.TEXTURE_2D_ARRAY]=xe(n.TEXTURE_2D_ARRAY,n.TEXTURE_2D_ARRAY,1,1),Ae[n.TEXTURE_3D]=xe(n.TEXTURE_3D,n.TEXTURE_3D,1,1),r.setClear(0,0,0,1),o.setClear(1),a.setClear(0),Se(n.DEPTH_TEST),o.setFunc(no),un(!1),Ut(hd),Se(n.CULL_FACE),Zt(pr);function Se(O){u[O]!==!0&&(n.enable(O),u[O]=!0)}function We(O){u[O]!==!1&&(n.disable(O),u[O]=!1)}function ot(O,re){return h[O]!==re?(n.bindFramebuffer(O,re),h[O]=re,O===n.DRAW_FRAMEBUFFER&&(h[n.FRAMEBUFFER]=re),O===n.FRAMEBUFFER&&(h[n.DRAW_FRAMEBUFFER]=re),!0):!1}function Ge(O,re){let ne=m,we=!1;if(O){ne=f.get(re),ne===void 0&&(ne=[],f.set(re,ne));let ge=O.textures;if(ne.length!==ge.length||ne[0]!==n.COLOR_ATTACHMENT0){for(let be=0,He=ge.length;be<He;be++)ne[be]=n.COLOR_ATTACHMENT0+be;ne.length=ge.length,we=!0}}else ne[0]!==n.BACK&&(ne[0]=n.BACK,we=!0);we&&n.drawBuffers(ne)}function dt(O){return y!==O?(n.useProgram(O),y=O,!0):!1}let ct={[mr]:n.FUNC_ADD,[Fm]:n.FUNC_SUBTRACT,[km]:n.FUNC_REVERSE_SUBTRACT};ct[Bm]=n.MIN,ct[zm]=n.MAX;let it={[Vm]:n.ZERO,[Gm]:n.ONE,[Hm]:n.SRC_COLOR,[md]:n.SRC_ALPHA,[Zm]:n.SRC_ALPHA_SATURATE,[Ym]:n.DST_COLOR,[Xm]:n.DST_ALPHA,[Wm]:n.ONE_MINUS_SRC_COLOR,[gd]:n.ONE_MINUS_SRC_ALPHA,[$m]:n.ONE_MINUS_DST_COLOR,[qm]:n.ONE_MINUS_DST_ALPHA,[Jm]:n.CONSTANT_COLOR,[Km]:n.ONE_MINUS_CONSTANT_COLOR,[jm]:n.CONSTANT_ALPHA,[Qm]:n.ONE_MINUS_CONSTANT_ALPHA};function Zt(O,re,ne,we,ge,be,He,Ke,le,ke){if(O===pr){g===!0&&(We(n.BLEND),g=!1);return}if(g===!1&&(Se(n.BLEND),g=!0),O!==Om){if(O!==_||ke!==D){if((b!==mr||P!==mr)&&(n.blendEquation(n.FUNC_ADD),b=mr,P=mr),ke)switch(O){case xo:n.blendFuncSeparate(n.ONE,n.ONE_MINUS_SRC_ALPHA,n.ONE,n.ONE_MINUS_SRC_ALPHA);break;case dd:n.blendFunc(n.ONE,n.ONE);break;case fd:n.blendFuncSeparate(n.ZERO,n.ONE_MINUS_SRC_COLOR,n.ZERO,n.ONE);break;case pd:n.blendFuncSeparate(n.DST_COLOR,n.ONE_MINUS_SRC_ALPHA,n.ZERO,n.ONE);break;default:Qe("WebGLState: Invalid blending: ",O);break}else switch(O){case xo:n.blendFuncSeparate(n.SRC_ALPHA,n.ONE_MINUS_SRC_ALPHA,n.ONE,n.ONE_MINUS_SRC_ALPHA);break;case dd:n.blendFuncSeparate(n.SRC_ALPHA,n.ONE,n.ONE,n.ONE);break;case fd:Qe("WebGLState: SubtractiveBlending requires material.premultipliedAlpha = true");break;case pd:Qe("WebGLState: MultiplyBlending requires material.premultipliedAlpha = true");break;default:Qe("WebGLState: Invalid blending: ",O);break}C=null,S=null,A=null,x=null,w.set(0,0,0),F=0,_=O,D=ke}return}ge=ge||re,be=be||ne,He=He||we,(re!==b||ge!==P)&&(n.blendEquationSeparate(ct[re],ct[ge]),b=re,P=ge),(ne!==C||we!==S||be!==A||He!==x)&&(n.blendFuncSeparate(it[ne],it[we],it[be],it[He]),C=ne,S=we,A=be,x=He),(Ke.equals(w)===!1||le!==F)&&(n.blendColor(Ke.r,Ke.g,Ke.b,le),w.copy(Ke),F=le),_=O,D=!1}function Gt(O,re){O.side===ns?We(n.CULL_FACE):Se(n.CULL_FACE);let ne=O.side===ti;re&&(ne=!ne),un(ne),O.blending===xo&&O.transparent===!1?Zt(pr):Zt(O.blending,O.blendEquation,O.blendSrc,O.blendDst,O.blendEquationAlpha,O.blendSrcAlpha,O.blendDstAlpha,O.blendColor,O.blendAlpha,O.premultipliedAlpha),o.setFunc(O.depthFunc),o.setTest(O.depthTest),o.setMask(O.depthWrite),r.setMask(O.colorWrite);let we=O.stencilWrite;a.setTest(we),we&&(a.setMask(O.stencilWriteMask),a.setFunc(O.stencilFunc,O.stencilRef,O.stencilFuncMask),a.setOp(O.stencilFail,O.stencilZFail,O.stencilZPass)),St(O.polygonOffset,O.polygonOffsetFactor,O.polygonOffsetUnits),O.alphaToCoverage===!0?Se(n.SAMPLE_ALPHA_TO_COVERAGE):We(n.SAMPLE_ALPHA_TO_COVERAGE)}function un(O){L!==O&&(O?n.frontFace(n.CW):n.frontFace(n.CCW),L=O)}function Ut(O){O!==Dm?(Se(n.CULL_FACE),O!==B&&(O===hd?n.cullFace(n.BACK):O===Nm?n.cullFace(n.FRONT):n.cullFace(n.FRONT_AND_BACK))):We(n.CULL_FACE),B=O}function Cn(O){O!==V&&(W&&n.lineWidth(O),V=O)}function St(O,re,ne){O?(Se(n.POLYGON_OFFSET_FILL),(U!==re||X!==ne)&&(U=re,X=ne,o.getReversed()&&(re=-re,ne=-ne),n.polygonOffset(re,ne))):We(n.POLYGON_OFFSET_FILL)}function vn(O){O?Se(n.SCISSOR_TEST):We(n.SCISSOR_TEST)}function tn(O){O===void 0&&(O=n.TEXTURE0+$-1),Q!==O&&(n.activeTexture(O),Q=O)}function hn(O,re,ne){ne===void 0&&(Q===null?ne=n.TEXTURE0+$-1:ne=Q);let we=se[ne];we===void 0&&(we={type:void 0,texture:void 0},se[ne]=we),(we.type!==O||we.texture!==re)&&(Q!==ne&&(n.activeTexture(ne),Q=ne),n.bindTexture(O,re||Ae[O]),we.type=O,we.texture=re)}function k(){let O=se[Q];O!==void 0&&O.type!==void 0&&(n.bindTexture(O.type,null),O.type=void 0,O.texture=void 0)}function Re(){try{n.compressedTexImage2D(...arguments)}catch(O){Qe("WebGLState:",O)}}function Ze(){try{n.compressedTexImage3D(...arguments)}catch(O){Qe("WebGLState:",O)}}function at(){try{n.texSubImage2D(...arguments)}catch(O){Qe("WebGLState:",O)}}function Me(){try{n.texSubImage3D(...arguments)}catch(O){Qe("WebGLState:",O)}}function Ft(){try{n.compressedTexSubImage2D(...arguments)}catch(O){Qe("WebGLState:",O)}}function Ve(){try{n.compressedTexSubImage3D(...arguments)}catch(O){Qe("WebGLState:",O)}}function Ye(){try{n.texStorage2D(...arguments)}catch(O){Qe("WebGLState:",O)}}function R(){try{n.texStorage3D(...arguments)}catch(O){Qe("WebGLState:",O)}}function M(){try{n.texImage2D(...arguments)}catch(O){Qe("WebGLState:",O)}}function q(){try{n.texImage3D(...arguments)}catch(O){Qe("WebGLState:",O)}}function ue(O){return d[O]!==void 0?d[O]:n.getParameter(O)}function oe(O,re){d[O]!==re&&(n.pixelStorei(O,re),d[O]=re)}function _e(O){ee.equals(O)===!1&&(n.scissor(O.x,O.y,O.z,O.w),ee.copy(O))}function ve(O){me.equals(O)===!1&&(n.viewport(O.x,O.y,O.z,O.w),me.copy(O))}function te(O,re){let ne=c.get(re);ne===void 0&&(ne=new WeakMap,c.set(re,ne));let we=ne.get(O);we===void 0&&(we=n.getUniformBlockIndex(re,O.name),n.uniformBlockBinding(re,we,we),ne.set(O,we))}function ie(O,re,ne){let ge=c.get(re).get(O);l[ge]!==ne&&(n.bindBufferBase(n.UNIFORM_BUFFER,ge,ne),l[ge]=ne)}function pe(){n.disable(n.BLEND),n.disable(n.CULL_FACE),n.disable(n.DEPTH_TEST),n.disable(n.POLYGON_OFFSET_FILL),n.disable(n.SCISSOR_TEST),n.disable(n.STENCIL_TEST),n.disable(n.SAMPLE_ALPHA_TO_COVERAGE),n.blendEquation(n.FUNC_ADD),n.blendFunc(n.ONE,n.ZERO),n.blendFuncSeparate(n.ONE,n.ZERO,n.ONE,n.ZERO),n.blendColor(0,0,0,0),n.colorMask(!0,!0,!0,!0),n.clearColor(0,0,0,0),n.depthMask(!0),n.depthFunc(n.LESS),o.setReversed(!1),n.clearDepth(1),n.stencilMask(4294967295),n.stencilFunc(n.ALWAYS,0,4294967295),n.stencilOp(n.KEEP,n.KEEP,n.KEEP),n.clearStencil(0),n.cullFace(n.BACK),n.frontFace(n.CCW),n.polygonOffset(0,0),n.activeTexture(n.TEXTURE0),n.bindFramebuffer(n.FRAMEBUFFER,null),n.bindFramebuffer(n.DRAW_FRAMEBUFFER,null),n.bindFramebuffer(n.READ_FRAMEBUFFER,null),n.useProgram(null),n.lineWidth(1),n.scissor(0,0,n.canvas.width,n.canvas.height),n.viewport(0,0,n.canvas.width,n.canvas.height),n.pixelStorei(n.PACK_ALIGNMENT,4),n.pixelStorei(n.UNPACK_ALIGNMENT,4),n.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,!1),n.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),n.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,n.BROWSER_DEFAULT_WEBGL),n.pixelStorei(n.PACK_ROW_LENGTH,0),n.pixelStorei(n.PACK_SKIP_PIXELS,0),n.pixelStorei(n.PACK_SKIP_ROWS,0),n.pixelStorei(n.UNPACK_ROW_LENGTH,0),n.pixelStorei(n.UNPACK_IMAGE_HEIGHT,0),n.pixelStorei(n.UNPACK_SKIP_PIXELS,0),n.pixelStorei(n.UNPACK_SKIP_ROWS,0),n.pixelStorei(n.UNPACK_SKIP_IMAGES,0),u={},d={},Q=null,se={},h={},l={},f=new WeakMap,m=[],y=null,g=!1,_=null,b=null,C=null,S=null,P=null,A=null,x=null,w=new tt(0,0,0),F=0,D=!1,L=null,B=null,V=null,U=null,X=null,ee.set(0,0,n.canvas.width,n.canvas.height),me.set(0,0,n.canvas.width,n.canvas.height),r.reset(),o.reset(),a.reset()}return{buffers:{color:r,depth:o,stencil:a},enable:Se,disable:We,bindFramebuffer:ot,drawBuffers:Ge,useProgram:dt,setBlending:Zt,setMaterial:Gt,setFlipSided:un,setCullFace:Ut,setLineWidth:Cn,setPolygonOffset:St,setScissorTest:vn,activeTexture:tn,bindTexture:hn,unbindTexture:k,compressedTexImage2D:Re,compressedTexImage3D:Ze,texImage2D:M,texImage3D:q,pixelStorei:oe,getParameter:ue,updateUBOMapping:te,uniformBlockBinding:ie,texStorage2D:Ye,texStorage3D:R,texSubImage2D:at,texSubImage3D:Me,compressedTexSubImage2D:Ft,compressedTexSubImage3D:Ve,scissor:_e,viewport:ve,reset:pe}}function Tw(n,e,t,i,s,r,o){let a=e.has("WEBGL_multisampled_render_to_texture")?e.get("WEBGL_multisampled_render_to_texture"):null,l=typeof navigator>"u"?!1:/OculusBrowser/g.test(navigator.userAgent),c=new qe,u=new WeakMap,d=new Set,h,f=new WeakMap,m=new Set,y=new FinalizationRegistry(R=>m.delete(R)),g=!1;try{g=typeof OffscreenCanvas<"u"&&new OffscreenCanvas(1,1).getContext("2d")!==null}catch{}function _(R,M){return g?new OffscreenCanvas(R,M):ua("canvas")}function b(R,M,q){let ue=1,oe=Ye(R);if((oe.width>q||oe.height>q)&&(ue=q/Math.max(oe.width,oe.height)),ue<1)if(typeof HTMLImageElement<"u"&&R instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&R instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&R instanceof ImageBitmap||typeof VideoFrame<"u"&&R instanceof VideoFrame){let _e=Math.floor(ue*oe.width),ve=Math.floor(ue*oe.height);h===void 0&&(h=_(_e,ve));let te=M?_(_e,ve):h;return te.width=_e,te.height=ve,te.getContext("2d").drawImage(R,0,0,_e,ve),$e("WebGLRenderer: Texture has been resized from ("+oe.width+"x"+oe.height+") to ("+_e+"x"+ve+")."),te}else return"data"in R&&$e("WebGLRenderer: Image in DataTexture is too big ("+oe.width+"x"+oe.height+")."),R;return R}function C(R){return R.generateMipmaps}function S(R){n.generateMipmap(R)}function P(R){return R.isWebGLCubeRenderTarget?n.TEXTURE_CUBE_MAP:R.isWebGL3DRenderTarget?n.TEXTURE_3D:R.isWebGLArrayRenderTarget||R.isCompressedArrayTexture?n.TEXTURE_2D_ARRAY:n.TEXTURE_2D}function A(R,M,q,ue,oe,_e=!1){if(R!==null){if(n[R]!==void 0)return n[R];$e("WebGLRenderer: Attempt to use non-existing WebGL internal format '"+R+"'")}let ve;ue&&(ve=e.get("EXT_texture_norm16"),ve||$e("WebGLRenderer: Unable to use normalized textures without EXT_texture_norm16 extension"));let te=M;if(M===n.RED&&(q===n.FLOAT&&(te=n.R32F),q===n.HALF_FLOAT&&(te=n.R16F),q===n.UNSIGNED_BYTE&&(te=n.R8),q===n.UNSIGNED_SHORT&&ve&&(te=ve.R16_EXT),q===n.SHORT&&ve&&(te=ve.R16_SNORM_EXT)),M===n.RED_INTEGER&&(q===n.UNSIGNED_BYTE&&(te=n.R8UI),q===n.UNSIGNED_SHORT&&(te=n.R16UI),q===n.UNSIGNED_INT&&(te=n.R32UI),q===n.BYTE&&(te=n.R8I),q===n.SHORT&&(te=n.R16I),q===n.INT&&(te=n.R32I)),M===n.RG&&(q===n.FLOAT&&(te=n.RG32F),q===n.HALF_FLOAT&&(te=n.RG16F),q===n.UNSIGNED_BYTE&&(te=n.RG8),q===n.UNSIGNED_SHORT&&ve&&(te=ve.RG16_EXT),q===n.SHORT&&ve&&(te=ve.RG16_SNORM_EXT)),M===n.RG_INTEGER&&(q===n.UNSIGNED_BYTE&&(te=n.RG8UI),q===n.UNSIGNED_SHORT&&(te=n.RG16UI),q===n.UNSIGNED_INT&&(te=n.RG32UI),q===n.BYTE&&(te=n.RG8I),q===n.SHORT&&(te=n.RG16I),q===n.INT&&(te=n.RG32I)),M===n.RGB_INTEGER&&(q===n.UNSIGNED_BYTE&&(te=n.RGB8UI),q===n.UNSIGNED_SHORT&&(te=n.RGB16UI),q===n.UNSIGNED_INT&&(te=n.RGB32UI),q===n.BYTE&&(te=n.RGB8I),q===n.SHORT&&(te=n.RGB16I),q===n.INT&&(te=n.RGB32I)),M===n.RGBA_INTEGER&&(q===n.UNSIGNED_BYTE&&(te=n.RGBA8UI),q===n.UNSIGNED_SHORT&&(te=n.RGBA16UI),q===n.UNSIGNED_INT&&(te=n.RGBA32UI),q===n.BYTE&&(te=n.RGBA8I),q===n.SHORT&&(te=n.RGBA16I),q===n.INT&&(te=n.RGBA32I)),M===n.RGB&&(q===n.UNSIGNED_SHORT&&ve&&(te=ve.RGB16_EXT),q===n.SHORT&&ve&&(te=ve.RGB16_SNORM_EXT),q===n.UNSIGNED_INT_5_9_9_9_REV&&(te=n.RGB9_E5),q===n.UNSIGNED_INT_10F_11F_11F_REV&&(te=n.R11F_G11F_B10F)),M===n.RGBA){let ie=_e?ca:yt.getTransfer(oe);q===n.FLOAT&&(te=n.RGBA32F),q===n.HALF_FLOAT&&(te=n.RGBA16F),q===n.UNSIGNED_BYTE&&(te=ie===Rt?n.SRGB8_ALPHA8:n.RGBA8),q===n.UNSIGNED_SHORT&&ve&&(te=ve.RGBA16_EXT),q===n.SHORT&&ve&&(te=ve.RGBA16_SNORM_EXT),q===n.UNSIGNED_SHORT_4_4_4_4&&(te=n.RGBA4),q===n.UNSIGNED_SHORT_5_5_5_1&&(te=n.RGB5_A1)}return(te===n.R16F||te===n.R32F||te===n.RG16F||te===n.RG32F||te===n.RGBA16F||te===n.RGBA32F)&&e.get("EXT_color_buffer_float"),te}function x(R,M){let q;return R?M===null||M===Fi||M===_r?q=n.DEPTH24_STENCIL8:M===ki?q=n.DEPTH32F_STENCIL8:M===yo&&(q=n.DEPTH24_STENCIL8,$e("DepthTexture: 16 bit depth attachment is not supported with stencil. Using 24-bit attachment.")):M===null||M===Fi||M===_r?q=n.DEPTH_COMPONENT24:M===ki?q=n.DEPTH_COMPONENT32F:M===yo&&(q=n.DEPTH_COMPONENT16),q}function w(R,M){return C(R)===!0||R.isFramebufferTexture&&R.minFilter!==Nn&&R.minFilter!==Qn?Math.log2(Math.max(M.width,M.height))+1:R.mipmaps.length>0?R.mipmaps.length:R.isCompressedTexture&&Array.isArray(R.image)?M.mipmaps.length:1}function F(R){let M=new WeakRef(R);i.get(R).__ref=M,m.add(M),y.register(R,M,M)}function D(R){let M=i.get(R).__ref;M!==void 0&&(m.delete(M),y.unregister(M))}function L(R){V(R.target)}function B(R){U(R.target)}function V(R){R.removeEventListener("dispose",L),D(R),$(R),R.isVideoTexture&&u.delete(R),R.isHTMLTexture&&d.delete(R)}function U(R){R.removeEventListener("dispose",B),D(R),ce(R)}function X(){for(let R of m){let M=R.deref();M!==void 0&&(M.isRenderTarget===!0?U(M):V(M))}m.clear(),d.clear()}function $(R){let M=i.get(R);if(M.__webglInit===void 0)return;let q=R.source,ue=f.get(q);if(ue){let oe=ue[M.__cacheKey];oe.usedTimes--,oe.usedTimes===0&&W(R),Object.keys(ue).length===0&&f.delete(q)}i.remove(R)}function W(R){let M=i.get(R);n.deleteTexture(M.__webglTexture);let q=R.source,ue=f.get(q);delete ue[M.__cacheKey],o.memory.textures--}function ce(R){let M=i.get(R);M.__depthDisposeCallback&&M.__depthDisposeCallback();let q=R.depthTexture;if(q&&q.renderTarget===R&&V(q),R.isWebGLCubeRenderTarget)for(let oe=0;oe<6;oe++){if(Array.isArray(M.__webglFramebuffer[oe]))for(let _e=0;_e<M.__webglFramebuffer[oe].length;_e++)n.deleteFramebuffer(M.__webglFramebuffer[oe][_e]);else n.deleteFramebuffer(M.__webglFramebuffer[oe]);M.__webglDepthbuffer&&n.deleteRenderbuffer(M.__webglDepthbuffer[oe])}else{if(Array.isArray(M.__webglFramebuffer))for(let oe=0;oe<M.__webglFramebuffer.length;oe++)n.deleteFramebuffer(M.__webglFramebuffer[oe]);else n.deleteFramebuffer(M.__webglFramebuffer);if(M.__webglDepthbuffer&&n.deleteRenderbuffer(M.__webglDepthbuffer),M.__webglMultisampledFramebuffer&&n.deleteFramebuffer(M.__webglMultisampledFramebuffer),M.__webglColorRenderbuffer)for(let oe=0;oe<M.__webglColorRenderbuffer.length;oe++)M.__webglColorRenderbuffer[oe]&&n.deleteRenderbuffer(M.__webglColorRenderbuffer[oe]);M.__webglDepthRenderbuffer&&n.deleteRenderbuffer(M.__webglDepthRenderbuffer)}let ue=R.textures;for(let oe=0,_e=ue.length;oe<_e;oe++){let ve=i.get(ue[oe]);ve.__webglTexture&&(n.deleteTexture(ve.__webglTexture),o.memory.textures--),i.remove(ue[oe])}i.remove(R)}let K=0;function Q(){K=0}function se(){return K}function de(R){K=R}function he(){let R=K;return R>=s.maxTextures&&$e("WebGLTextures: Trying to use "+(R+1)+" texture units while this GPU supports only "+s.maxTextures),K+=1,R}function ee(R){let M=[];return M.push(R.wrapS),M.push(R.wrapT),M.push(R.wrapR||0),M.push(R.magFilter),M.push(R.minFilter),M.push(R.anisotropy),M.push(R.internalFormat),M.push(R.format),M.push(R.type),M.push(R.generateMipmaps),M.push(R.mipmapsAutoUpdate),M.push(R.premultiplyAlpha),M.push(R.flipY),M.push(R.unpackAlignment),M.push(R.colorSpace),M.join()}function me(R,M){let q=i.get(R);if(R.isVideoTexture&&Ft(R),R.isRenderTargetTexture===!1&&R.isExternalTexture!==!0&&R.version>0&&q.__version!==R.version){let ue=R.image;if(ue===null)$e("WebGLRenderer: Texture marked for update but no image data found.");else if(ue.complete===!1)$e("WebGLRenderer: Texture marked for update but image is incomplete");else{Gt(q,R,M);return}}else R.isExternalTexture&&(q.__webglTexture=R.sourceTexture?R.sourceTexture:null);t.bindTexture(n.TEXTURE_2D,q.__webglTexture,n.TEXTURE0+M)}function xe(R,M){let q=i.get(R);if(R.isRenderTargetTexture===!1&&R.version>0&&q.__version!==R.version){Gt(q,R,M);return}else R.isExternalTexture&&(q.__webglTexture=R.sourceTexture?R.sourceTexture:null);t.bindTexture(n.TEXTURE_2D_ARRAY,q.__webglTexture,n.TEXTURE0+M)}function Ae(R,M){let q=i.get(R);if(R.isRenderTargetTexture===!1&&R.version>0&&q.__version!==R.version){Gt(q,R,M);return}t.bindTexture(n.TEXTURE_3D,q.__webglTexture,n.TEXTURE0+M)}function Se(R,M){let q=i.get(R);if(R.version>0&&q.__version!==R.version){un(q,R,M);return}t.bindTexture(n.TEXTURE_CUBE_MAP,q.__webglTexture,n.TEXTURE0+M)}let We={[sc]:n.REPEAT,[Qi]:n.CLAMP_TO_EDGE,[rc]:n.MIRRORED_REPEAT},ot={[Nn]:n.NEAREST,[ng]:n.NEAREST_MIPMAP_NEAREST,[Fa]:n.NEAREST_MIPMAP_LINEAR,[Qn]:n.LINEAR,[Dc]:n.LINEAR_MIPMAP_NEAREST,[Es]:n.LINEAR_MIPMAP_LINEAR},Ge={[og]:n.NEVER,[Ud]:n.ALWAYS,[ag]:n.LESS,[Dd]:n.LEQUAL,[lg]:n.EQUAL,[Nd]:n.GEQUAL,[cg]:n.GREATER,[ug]:n.NOTEQUAL};function dt(R,M){if(M.type===ki&&e.has("OES_texture_float_linear")===!1&&(M.magFilter===Qn||M.magFilter===Dc||M.magFilter===Fa||M.magFilter===Es||M.minFilter===Qn||M.minFilter===Dc||M.minFilter===Fa||M.minFilter===Es)&&$e("WebGLRenderer: Unable to use linear filtering with floating point textures. OES_texture_float_linear not supported on this device."),n.texParameteri(R,n.TEXTURE_WRAP_S,We[M.wrapS]),n.texParameteri(R,n.TEXTURE_WRAP_T,We[M.wrapT]),(R===n.TEXTURE_3D||R===n.TEXTURE_2D_ARRAY)&&n.texParameteri(R,n.TEXTURE_WRAP_R,We[M.wrapR]),n.texParameteri(R,n.TEXTURE_MAG_FILTER,ot[M.magFilter]),n.texParameteri(R,n.TEXTURE_MIN_FILTER,ot[M.minFilter]),M.compareFunction&&(n.texParameteri(R,n.TEXTURE_COMPARE_MODE,n.COMPARE_REF_TO_TEXTURE),n.texParameteri(R,n.TEXTURE_COMPARE_FUNC,Ge[M.compareFunction])),e.has("EXT_texture_filter_anisotropic")===!0){if(M.magFilter===Nn||M.minFilter!==Fa&&M.minFilter!==Es||M.type===ki&&e.has("OES_texture_float_linear")===!1)return;if(M.anisotropy>1||i.get(M).__currentAnisotropy){let q=e.get("EXT_texture_filter_anisotropic");n.texParameterf(R,q.TEXTURE_MAX_ANISOTROPY_EXT,Math.min(M.anisotropy,s.getMaxAnisotropy())),i.get(M).__currentAnisotropy=M.anisotropy}}}function ct(R,M){let q=!1;R.__webglInit===void 0&&(R.__webglInit=!0,M.addEventListener("dispose",L),F(M));let ue=M.source,oe=f.get(ue);oe===void 0&&(oe={},f.set(ue,oe));let _e=ee(M);if(_e!==R.__cacheKey){oe[_e]===void 0&&(oe[_e]={texture:n.createTexture(),usedTimes:0},o.memory.textures++,q=!0),oe[_e].usedTimes++;let ve=oe[R.__cacheKey];ve!==void 0&&(oe[R.__cacheKey].usedTimes--,ve.usedTimes===0&&W(M)),R.__cacheKey=_e,R.__webglTexture=oe[_e].texture}return q}function it(R,M,q){return Math.floor(Math.floor(R/q)/M)}function Zt(R,M,q,ue){let _e=R.updateRanges;if(_e.length===0)t.texSubImage2D(n.TEXTURE_2D,0,0,0,M.width,M.height,q,ue,M.data);else{_e.sort((O,re)=>O.start-re.start);let ve=0;for(let O=1;O<_e.length;O++){let re=_e[ve],ne=_e[O],we=re.start+re.count,ge=it(ne.start,M.width,4),be=it(re.start,M.width,4);ne.start<=we+1&&ge===be&&it(ne.start+ne.count-1,M.width,4)===ge?re.count=Math.max(re.count,ne.start+ne.count-re.start):(++ve,_e[ve]=ne)}_e.length=ve+1;let te=t.getParameter(n.UNPACK_ROW_LENGTH),ie=t.getParameter(n.UNPACK_SKIP_PIXELS),pe=t.getParameter(n.UNPACK_SKIP_ROWS);t.pixelStorei(n.UNPACK_ROW_LENGTH,M.width);for(let O=0,re=_e.length;O<re;O++){let ne=_e[O],we=Math.floor(ne.start/4),ge=Math.ceil(ne.count/4),be=we%M.width,He=Math.floor(we/M.width),Ke=ge,le=1;t.pixelStorei(n.UNPACK_SKIP_PIXELS,be),t.pixelStorei(n.UNPACK_SKIP_ROWS,He),t.texSubImage2D(n.TEXTURE_2D,0,be,He,Ke,le,q,ue,M.data)}R.clearUpdateRanges(),t.pixelStorei(n.UNPACK_ROW_LENGTH,te),t.pixelStorei(n.UNPACK_SKIP_PIXELS,ie),t.pixelStorei(n.UNPACK_SKIP_ROWS,pe)}}function Gt(R,M,q){let ue=n.TEXTURE_2D;(M.isDataArrayTexture||M.isCompressedArrayTexture)&&(ue=n.TEXTURE_2D_ARRAY),M.isData3DTexture&&(ue=n.TEXTURE_3D);let oe=ct(R,M),_e=M.source;t.bindTexture(ue,R.__webglTexture,n.TEXTURE0+q);let ve=i.get(_e);if(_e.version!==ve.__version||oe===!0){if(t.activeTexture(n.TEXTURE0+q),(typeof ImageBitmap<"u"&&M.image instanceof ImageBitmap)===!1){let le=yt.getPrimaries(yt.workingColorSpace),ke=M.colorSpace===Cs?null:yt.getPrimaries(M.colorSpace),je=M.colorSpace===Cs||le===ke?n.NONE:n.BROWSER_DEFAULT_WEBGL;t.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,M.flipY),t.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,M.premultiplyAlpha),t.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,je)}t.pixelStorei(n.UNPACK_ALIGNMENT,M.unpackAlignment);let ie=b(M.image,!1,s.maxTextureSize);ie=Ve(M,ie);let pe=r.convert(M.format,M.colorSpace),O=r.convert(M.type),re=A(M.internalFormat,pe,O,M.normalized,M.colorSpace,M.isVideoTexture);dt(ue,M);let ne,we=M.mipmaps,ge=M.isVideoTexture!==!0,be=ve.__version===void 0||oe===!0,He=_e.dataReady,Ke=w(M,ie);if(M.isDepthTexture)re=x(M.format===As,M.type),be&&(ge?t.texStorage2D(n.TEXTURE_2D,1,re,ie.width,ie.height):t.texImage2D(n.TEXTURE_2D,0,re,ie.width,ie.height,0,pe,O,null));else if(M.isDataTexture)if(we.length>0){ge&&be&&t.texStorage2D(n.TEXTURE_2D,Ke,re,we[0].width,we[0].height);for(let le=0,ke=we.length;le<ke;le++)ne=we[le],ge?He&&t.texSubImage2D(n.TEXTURE_2D,le,0,0,ne.width,ne.height,pe,O,ne.data):t.texImage2D(n.TEXTURE_2D,le,re,ne.width,ne.height,0,pe,O,ne.data);M.generateMipmaps=!1}else ge?(be&&t.texStorage2D(n.TEXTURE_2D,Ke,re,ie.width,ie.height),He&&Zt(M,ie,pe,O)):t.texImage2D(n.TEXTURE_2D,0,re,ie.width,ie.height,0,pe,O,ie.data);else if(M.isCompressedTexture)if(M.isCompressedArrayTexture){ge&&be&&t.texStorage3D(n.TEXTURE_2D_ARRAY,Ke,re,we[0].width,we[0].height,ie.depth);for(let le=0,ke=we.length;le<ke;le++)if(ne=we[le],M.format!==zi)if(pe!==null)if(ge){if(He)if(M.layerUpdates.size>0){let je=qd(ne.width,ne.height,M.format,M.type);for(let Ce of M.layerUpdates){let lt=ne.data.subarray(Ce*je/ne.data.BYTES_PER_ELEMENT,(Ce+1)*je/ne.data.BYTES_PER_ELEMENT);t.compressedTexSubImage3D(n.TEXTURE_2D_ARRAY,le,0,0,Ce,ne.width,ne.height,1,pe,lt)}}else t.compressedTexSubImage3D(n.TEXTURE_2D_ARRAY,le,0,0,0,ne.width,ne.height,ie.depth,pe,ne.data)}else t.compressedTexImage3D(n.TEXTURE_2D_ARRAY,le,re,ne.width,ne.height,ie.depth,0,ne.data,0,0);else $e("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()");else ge?He&&t.texSubImage3D(n.TEXTURE_2D_ARRAY,le,0,0,0,ne.width,ne.height,ie.depth,pe,O,ne.data):t.texImage3D(n.TEXTURE_2D_ARRAY,le,re,ne.width,ne.height,ie.depth,0,pe,O,ne.data);M.layerUpdates.size>0&&M.clearLayerUpdates()}else{ge&&be&&t.texStorage2D(n.TEXTURE_2D,Ke,re,we[0].width,we[0].height);for(let le=0,ke=we.length;le<ke;le++)ne=we[le],M.format!==zi?pe!==null?ge?He&&t.compressedTexSubImage2D(n.TEXTURE_2D,le,0,0,ne.width,ne.height,pe,ne.data):t.compressedTexImage2D(n.TEXTURE_2D,le,re,ne.width,ne.height,0,ne.data):$e("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()"):ge?He&&t.texSubImage2D(n.TEXTURE_2D,le,0,0,ne.width,ne.height,pe,O,ne.data):t.texImage2D(n.TEXTURE_2D,le,re,ne.width,ne.height,0,pe,O,ne.data)}else if(M.isDataArrayTexture)if(ge){if(be&&t.texStorage3D(n.TEXTURE_2D_ARRAY,Ke,re,ie.width,ie.height,ie.depth),He)if(M.layerUpdates.size>0){let le=qd(ie.width,ie.height,M.format,M.type);for(let ke of M.layerUpdates){let je=ie.data.subarray(ke*le/ie.data.BYTES_PER_ELEMENT,(ke+1)*le/ie.data.BYTES_PER_ELEMENT);t.texSubImage3D(n.TEXTURE_2D_ARRAY,0,0,0,ke,ie.width,ie.height,1,pe,O,je)}M.clearLayerUpdates()}else t.texSubImage3D(n.TEXTURE_2D_ARRAY,0,0,0,0,ie.width,ie.height,ie.depth,pe,O,ie.data)}else t.texImage3D(n.TEXTURE_2D_ARRAY,0,re,ie.width,ie.height,ie.depth,0,pe,O,ie.data);else if(M.isData3DTexture)ge?(be&&t.texStorage3D(n.TEXTURE_3D,Ke,re,ie.width,ie.height,ie.depth),He&&t.texSubImage3D(n.TEXTURE_3D,0,0,0,0,ie.width,ie.height,ie.depth,pe,O,ie.data)):t.texImage3D(n.TEXTURE_3D,0,re,ie.width,ie.height,ie.depth,0,pe,O,ie.data);else if(M.isFramebufferTexture){if(be)if(ge)t.texStorage2D(n.TEXTURE_2D,Ke,re,ie.width,ie.height);else{let le=ie.width,ke=ie.height;for(let je=0;je<Ke;je++)t.texImage2D(n.TEXTURE_2D,je,re,le,ke,0,pe,O,null),le>>=1,ke>>=1}}else if(M.isHTMLTexture){if("texElementImage2D"in n){let le=n.canvas;if(le.hasAttribute("layoutsubtree")||le.setAttribute("layoutsubtree","true"),ie.parentNode!==le){le.appendChild(ie),d.add(M),le.onpaint=ke=>{let je=ke.changedElements;for(let Ce of d)je.includes(Ce.image)&&(Ce.needsUpdate=!0)},le.requestPaint();return}if(n.texElementImage2D.length===3)n.texElementImage2D(n.TEXTURE_2D,n.RGBA8,ie);else{let je=n.RGBA,Ce=n.RGBA,lt=n.UNSIGNED_BYTE;n.texElementImage2D(n.TEXTURE_2D,0,je,Ce,lt,ie)}n.texParameteri(n.TEXTURE_2D,n.TEXTURE_MIN_FILTER,n.LINEAR),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_S,n.CLAMP_TO_EDGE),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_T,n.CLAMP_TO_EDGE)}}else if(we.length>0){if(ge&&be){let le=Ye(we[0]);t.texStorage2D(n.TEXTURE_2D,Ke,re,le.width,le.height)}for(let le=0,ke=we.length;le<ke;le++)ne=we[le],ge?He&&t.texSubImage2D(n.TEXTURE_2D,le,0,0,pe,O,ne):t.texImage2D(n.TEXTURE_2D,le,re,pe,O,ne);M.generateMipmaps=!1}else if(ge){if(be){let le=Ye(ie);t.texStorage2D(n.TEXTURE_2D,Ke,re,le.width,le.height)}He&&t.texSubImage2D(n.TEXTURE_2D,0,0,0,pe,O,ie)}else t.texImage2D(n.TEXTURE_2D,0,re,pe,O,ie);C(M)&&M.mipmapsAutoUpdate===!0&&S(ue),ve.__version=_e.version,M.onUpdate&&M.onUpdate(M)}R.__version=M.version}function un(R,M,q){if(M.image.length!==6)return;let ue=ct(R,M),oe=M.source;t.bindTexture(n.TEXTURE_CUBE_MAP,R.__webglTexture,n.TEXTURE0+q);let _e=i.get(oe);if(oe.version!==_e.__version||ue===!0){t.activeTexture(n.TEXTURE0+q);let ve=yt.getPrimaries(yt.workingColorSpace),te=M.colorSpace===Cs?null:yt.getPrimaries(M.colorSpace),ie=M.colorSpace===Cs||ve===te?n.NONE:n.BROWSER_DEFAULT_WEBGL;t.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,M.flipY),t.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,M.premultiplyAlpha),t.pixelStorei(n.UNPACK_ALIGNMENT,M.unpackAlignment),t.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,ie);let pe=M.isCompressedTexture||M.image[0].isCompressedTexture,O=M.image[0]&&M.image[0].isDataTexture,re=[];for(let Ce=0;Ce<6;Ce++)!pe&&!O?re[Ce]=b(M.image[Ce],!0,s.maxCubemapSize):re[Ce]=O?M.image[Ce].image:M.image[Ce],re[Ce]=Ve(M,re[Ce]);let ne=re[0],we=r.convert(M.format,M.colorSpace),ge=r.convert(M.type),be=A(M.internalFormat,we,ge,M.normalized,M.colorSpace),He=M.isVideoTexture!==!0,Ke=_e.__version===void 0||ue===!0,le=oe.dataReady,ke=w(M,ne);dt(n.TEXTURE_CUBE_MAP,M);let je;if(M.isDepthTexture){if(be=x(M.format===As,M.type),Ke)if(He)t.texStorage2D(n.TEXTURE_CUBE_MAP,1,be,ne.width,ne.height);else for(let Ce=0;Ce<6;Ce++)t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,0,be,ne.width,ne.height,0,we,ge,null)}else if(pe){He&&Ke&&t.texStorage2D(n.TEXTURE_CUBE_MAP,ke,be,ne.width,ne.height);for(let Ce=0;Ce<6;Ce++){je=re[Ce].mipmaps;for(let lt=0;lt<je.length;lt++){let Ht=je[lt];M.format!==zi?we!==null?He?le&&t.compressedTexSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,lt,0,0,Ht.width,Ht.height,we,Ht.data):t.compressedTexImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,lt,be,Ht.width,Ht.height,0,Ht.data):$e("WebGLRenderer: Attempt to load unsupported compressed texture format in .setTextureCube()"):He?le&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,lt,0,0,Ht.width,Ht.height,we,ge,Ht.data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,lt,be,Ht.width,Ht.height,0,we,ge,Ht.data)}}}else{if(je=M.mipmaps,He&&Ke){je.length>0&&ke++;let Ce=Ye(re[0]);t.texStorage2D(n.TEXTURE_CUBE_MAP,ke,be,Ce.width,Ce.height)}for(let Ce=0;Ce<6;Ce++)if(O){He?le&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,0,0,0,re[Ce].width,re[Ce].height,we,ge,re[Ce].data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,0,be,re[Ce].width,re[Ce].height,0,we,ge,re[Ce].data);for(let lt=0;lt<je.length;lt++){let Xn=je[lt].image[Ce].image;He?le&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,lt+1,0,0,Xn.width,Xn.height,we,ge,Xn.data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,lt+1,be,Xn.width,Xn.height,0,we,ge,Xn.data)}}else{He?le&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,0,0,0,we,ge,re[Ce]):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,0,be,we,ge,re[Ce]);for(let lt=0;lt<je.length;lt++){let Ht=je[lt];He?le&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,lt+1,0,0,we,ge,Ht.image[Ce]):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Ce,lt+1,be,we,ge,Ht.image[Ce])}}}C(M)&&M.mipmapsAutoUpdate===!0&&S(n.TEXTURE_CUBE_MAP),_e.__version=oe.version,M.onUpdate&&M.onUpdate(M)}R.__version=M.version}function Ut(R,M,q,ue,oe,_e){let ve=r.convert(q.format,q.colorSpace),te=r.convert(q.type),ie=A(q.internalFormat,ve,te,q.normalized,q.colorSpace),pe=i.get(M),O=i.get(q);if(O.__renderTarget=M,!pe.__hasExternalTextures){let re=Math.max(1,M.width>>_e),ne=Math.max(1,M.height>>_e);oe===n.TEXTURE_3D||oe===n.TEXTURE_2D_ARRAY?t.texImage3D(oe,_e,ie,re,ne,M.depth,0,ve,te,null):t.texImage2D(oe,_e,ie,re,ne,0,ve,te,null)}t.bindFramebuffer(n.FRAMEBUFFER,R),Me(M)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,ue,oe,O.__webglTexture,0,at(M)):(oe===n.TEXTURE_2D||oe>=n.TEXTURE_CUBE_MAP_POSITIVE_X&&oe<=n.TEXTURE_CUBE_MAP_NEGATIVE_Z)&&n.framebufferTexture2D(n.FRAMEBUFFER,ue,oe,O.__webglTexture,_e),t.bindFramebuffer(n.FRAMEBUFFER,null)}function Cn(R,M,q){if(n.bindRenderbuffer(n.RENDERBUFFER,R),M.depthBuffer){let ue=M.depthTexture,oe=ue&&ue.isDepthTexture?ue.type:null,_e=x(M.stencilBuffer,oe),ve=M.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;Me(M)?a.renderbufferStorageMultisampleEXT(n.RENDERBUFFER,at(M),_e,M.width,M.height):q?n.renderbufferStorageMultisample(n.RENDERBUFFER,at(M),_e,M.width,M.height):n.renderbufferStorage(n.RENDERBUFFER,_e,M.width,M.height),n.framebufferRenderbuffer(n.FRAMEBUFFER,ve,n.RENDERBUFFER,R)}else{let ue=M.textures;for(let oe=0;oe<ue.length;oe++){let _e=ue[oe],ve=r.convert(_e.format,_e.colorSpace),te=r.convert(_e.type),ie=A(_e.internalFormat,ve,te,_e.normalized,_e.colorSpace);Me(M)?a.renderbufferStorageMultisampleEXT(n.RENDERBUFFER,at(M),ie,M.width,M.height):q?n.renderbufferStorageMultisample(n.RENDERBUFFER,at(M),ie,M.width,M.height):n.renderbufferStorage(n.RENDERBUFFER,ie,M.width,M.height)}}n.bindRenderbuffer(n.RENDERBUFFER,null)}function St(R,M,q){let ue=M.isWebGLCubeRenderTarget===!0;if(t.bindFramebuffer(n.FRAMEBUFFER,R),!(M.depthTexture&&M.depthTexture.isDepthTexture))throw new Error("THREE.WebGLTextures: renderTarget.depthTexture must be an instance of THREE.DepthTexture.");let oe=i.get(M.depthTexture);oe.__renderTarget=M;let _e=ue?M.depthTexture.image[0]:M.depthTexture.image;(!oe.__webglTexture||_e.width!==M.width||_e.height!==M.height)&&(_e.width=M.width,_e.height=M.height,M.depthTexture.needsUpdate=!0),ue?Se(M.depthTexture,0):me(M.depthTexture,0);let ve=oe.__webglTexture,te=at(M),ie=ue?n.TEXTURE_CUBE_MAP_POSITIVE_X+q:n.TEXTURE_2D,pe=M.depthTexture.format===As?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;if(M.depthTexture.format===Ss)Me(M)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,pe,ie,ve,0,te):n.framebufferTexture2D(n.FRAMEBUFFER,pe,ie,ve,0);else if(M.depthTexture.format===As)Me(M)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,pe,ie,ve,0,te):n.framebufferTexture2D(n.FRAMEBUFFER,pe,ie,ve,0);else throw new Error("THREE.WebGLTextures: Unknown depthTexture format.")}function vn(R){let M=i.get(R),q=R.isWebGLCubeRenderTarget===!0;if(M.__boundDepthTexture!==R.depthTexture){let ue=R.depthTexture;if(M.__depthDisposeCallback&&M.__depthDisposeCallback(),ue){let oe=()=>{delete M.__boundDepthTexture,delete M.__depthDisposeCallback,ue.removeEventListener("dispose",oe)};ue.addEventListener("dispose",oe),M.__depthDisposeCallback=oe}M.__boundDepthTexture=ue}if(R.depthTexture&&!M.__autoAllocateDepthBuffer)if(q)for(let ue=0;ue<6;ue++)St(M.__webglFramebuffer[ue],R,ue);else R.texture.mipmaps.length>0?St(M.__webglFramebuffer[0],R,0):St(M.__webglFramebuffer,R,0);else if(q){M.__webglDepthbuffer=[];for(let ue=0;ue<6;ue++)if(t.bindFramebuffer(n.FRAMEBUFFER,M.__webglFramebuffer[ue]),M.__webglDepthbuffer[ue]===void 0)M.__webglDepthbuffer[ue]=n.createRenderbuffer(),Cn(M.__webglDepthbuffer[ue],R,!1);else{let oe=R.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,_e=M.__webglDepthbuffer[ue];n.bindRenderbuffer(n.RENDERBUFFER,_e),n.framebufferRenderbuffer(n.FRAMEBUFFER,oe,n.RENDERBUFFER,_e)}}else if(R.texture.mipmaps.length>0?t.bindFramebuffer(n.FRAMEBUFFER,M.__webglFramebuffer[0]):t.bindFramebuffer(n.FRAMEBUFFER,M.__webglFramebuffer),M.__webglDepthbuffer===void 0)M.__webglDepthbuffer=n.createRenderbuffer(),Cn(M.__webglDepthbuffer,R,!1);else{let oe=R.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,_e=M.__webglDepthbuffer;n.bindRenderbuffer(n.RENDERBUFFER,_e),n.framebufferRenderbuffer(n.FRAMEBUFFER,oe,n.RENDERBUFFER,_e)}t.bindFramebuffer(n.FRAMEBUFFER,null)}function tn(R,M,q){let ue=i.get(R);M!==void 0&&Ut(ue.__webglFramebuffer,R,R.texture,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,0),q!==void 0&&vn(R)}function hn(R){let M=R.texture,q=i.get(R),ue=i.get(M);R.addEventListener("dispose",B),F(R);let oe=R.textures,_e=R.isWebGLCubeRenderTarget===!0,ve=oe.length>1;if(ve||(ue.__webglTexture===void 0&&(ue.__webglTexture=n.createTexture()),ue.__version=M.version,o.memory.textures++),_e){q.__webglFramebuffer=[];for(let te=0;te<6;te++)if(M.mipmaps.length>0){q.__webglFramebuffer[te]=[];for(let ie=0;ie<M.mipmaps.length;ie++)q.__webglFramebuffer[te][ie]=n.createFramebuffer()}else q.__webglFramebuffer[te]=n.createFramebuffer()}else{if(M.mipmaps.length>0){q.__webglFramebuffer=[];for(let te=0;te<M.mipmaps.length;te++)q.__webglFramebuffer[te]=n.createFramebuffer()}else q.__webglFramebuffer=n.createFramebuffer();if(ve)for(let te=0,ie=oe.length;te<ie;te++){let pe=i.get(oe[te]);pe.__webglTexture===void 0&&(pe.__webglTexture=n.createTexture(),o.memory.textures++)}if(R.samples>0&&Me(R)===!1){q.__webglMultisampledFramebuffer=n.createFramebuffer(),q.__webglColorRenderbuffer=[],t.bindFramebuffer(n.FRAMEBUFFER,q.__webglMultisampledFramebuffer);for(let te=0;te<oe.length;te++){let ie=oe[te];q.__webglColorRenderbuffer[te]=n.createRenderbuffer(),n.bindRenderbuffer(n.RENDERBUFFER,q.__webglColorRenderbuffer[te]);let pe=r.convert(ie.format,ie.colorSpace),O=r.convert(ie.type),re=A(ie.internalFormat,pe,O,ie.normalized,ie.colorSpace,R.isXRRenderTarget===!0),ne=at(R);n.renderbufferStorageMultisample(n.RENDERBUFFER,ne,re,R.width,R.height),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+te,n.RENDERBUFFER,q.__webglColorRenderbuffer[te])}n.bindRenderbuffer(n.RENDERBUFFER,null),R.depthBuffer&&(q.__webglDepthRenderbuffer=n.createRenderbuffer(),Cn(q.__webglDepthRenderbuffer,R,!0)),t.bindFramebuffer(n.FRAMEBUFFER,null)}}if(_e){t.bindTexture(n.TEXTURE_CUBE_MAP,ue.__webglTexture),dt(n.TEXTURE_CUBE_MAP,M);for(let te=0;te<6;te++)if(M.mipmaps.length>0)for(let ie=0;ie<M.mipmaps.length;ie++)Ut(q.__webglFramebuffer[te][ie],R,M,n.COLOR_ATTACHMENT0,n.TEXTURE_CUBE_MAP_POSITIVE_X+te,ie);else Ut(q.__webglFramebuffer[te],R,M,n.COLOR_ATTACHMENT0,n.TEXTURE_CUBE_MAP_POSITIVE_X+te,0);C(M)?S(n.TEXTURE_CUBE_MAP):M.mipmaps.length>0&&n.texParameteri(n.TEXTURE_CUBE_MAP,n.TEXTURE_MAX_LEVEL,M.mipmaps.length-1),t.unbindTexture()}else if(ve){for(let te=0,ie=oe.length;te<ie;te++){let pe=oe[te],O=i.get(pe),re=n.TEXTURE_2D;(R.isWebGL3DRenderTarget||R.isWebGLArrayRenderTarget)&&(re=R.isWebGL3DRenderTarget?n.TEXTURE_3D:n.TEXTURE_2D_ARRAY),t.bindTexture(re,O.__webglTexture),dt(re,pe),Ut(q.__webglFramebuffer,R,pe,n.COLOR_ATTACHMENT0+te,re,0),C(pe)&&S(re)}t.unbindTexture()}else{let te=n.TEXTURE_2D;if((R.isWebGL3DRenderTarget||R.isWebGLArrayRenderTarget)&&(te=R.isWebGL3DRenderTarget?n.TEXTURE_3D:n.TEXTURE_2D_ARRAY),t.bindTexture(te,ue.__webglTexture),dt(te,M),M.mipmaps.length>0)for(let ie=0;ie<M.mipmaps.length;ie++)Ut(q.__webglFramebuffer[ie],R,M,n.COLOR_ATTACHMENT0,te,ie);else Ut(q.__webglFramebuffer,R,M,n.COLOR_ATTACHMENT0,te,0);C(M)?S(te):M.mipmaps.length>0&&n.texParameteri(te,n.TEXTURE_MAX_LEVEL,M.mipmaps.length-1),t.unbindTexture()}R.depthBuffer&&vn(R)}function k(R){let M=R.textures;for(let q=0,ue=M.length;q<ue;q++){let oe=M[q];if(C(oe)&&oe.mipmapsAutoUpdate===!0){let _e=P(R),ve=i.get(oe).__webglTexture;t.bindTexture(_e,ve),S(_e),t.unbindTexture()}}}let Re=[];function Ze(R){if(R.samples>0){if(Me(R)===!1){let M=R.textures,q=R.width,ue=R.height,oe=n.COLOR_BUFFER_BIT,_e=R.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,ve=i.get(R),te=M.length>1;if(te)for(let pe=0;pe<M.length;pe++)t.bindFramebuffer(n.FRAMEBUFFER,ve.__webglMultisampledFramebuffer),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+pe,n.RENDERBUFFER,null),t.bindFramebuffer(n.FRAMEBUFFER,ve.__webglFramebuffer),n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0+pe,n.TEXTURE_2D,null,0);t.bindFramebuffer(n.READ_FRAMEBUFFER,ve.__webglMultisampledFramebuffer),R.texture.mipmaps.length>0?t.bindFramebuffer(n.DRAW_FRAMEBUFFER,ve.__webglFramebuffer[0]):t.bindFramebuffer(n.DRAW_FRAMEBUFFER,ve.__webglFramebuffer);for(let pe=0;pe<M.length;pe++){if(R.resolveDepthBuffer&&(R.depthBuffer&&(oe|=n.DEPTH_BUFFER_BIT),R.stencilBuffer&&R.resolveStencilBuffer&&(oe|=n.STENCIL_BUFFER_BIT)),te){n.framebufferRenderbuffer(n.READ_FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.RENDERBUFFER,ve.__webglColorRenderbuffer[pe]);let O=i.get(M[pe]).__webglTexture;n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,O,0)}n.blitFramebuffer(0,0,q,ue,0,0,q,ue,oe,n.NEAREST),l===!0&&(Re.length=0,Re.push(n.COLOR_ATTACHMENT0+pe),R.depthBuffer&&R.storeMultisampledDepthBuffer===!1&&Re.push(_e),n.invalidateFramebuffer(n.READ_FRAMEBUFFER,Re))}if(t.bindFramebuffer(n.READ_FRAMEBUFFER,null),t.bindFramebuffer(n.DRAW_FRAMEBUFFER,null),te)for(let pe=0;pe<M.length;pe++){t.bindFramebuffer(n.FRAMEBUFFER,ve.__webglMultisampledFramebuffer),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+pe,n.RENDERBUFFER,ve.__webglColorRenderbuffer[pe]);let O=i.get(M[pe]).__webglTexture;t.bindFramebuffer(n.FRAMEBUFFER,ve.__webglFramebuffer),n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0+pe,n.TEXTURE_2D,O,0)}t.bindFramebuffer(n.DRAW_FRAMEBUFFER,ve.__webglMultisampledFramebuffer)}else if(R.depthBuffer&&R.storeMultisampledDepthBuffer===!1&&l){let M=R.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;n.invalidateFramebuffer(n.DRAW_FRAMEBUFFER,[M])}}}function at(R){return Math.min(s.maxSamples,R.samples)}function Me(R){let M=i.get(R);return R.samples>0&&e.has("WEBGL_multisampled_render_to_texture")===!0&&M.__useRenderToTexture!==!1}function Ft(R){let M=o.render.frame;u.get(R)!==M&&(u.set(R,M),R.update())}function Ve(R,M){let q=R.colorSpace,ue=R.format,oe=R.type;return R.isCompressedTexture===!0||R.isVideoTexture===!0||q!==la&&q!==Cs&&(yt.getTransfer(q)===Rt?(ue!==zi||oe!==oi)&&$e("WebGLTextures: sRGB encoded textures have to use RGBAFormat and UnsignedByteType."):Qe("WebGLTextures: Unsupported texture color space:",q)),M}function Ye(R){return typeof HTMLImageElement<"u"&&R instanceof HTMLImageElement?(c.width=R.naturalWidth||R.width,c.height=R.naturalHeight||R.height):typeof VideoFrame<"u"&&R instanceof VideoFrame?(c.width=R.displayWidth,c.height=R.displayHeight):(c.width=R.width,c.height=R.height),c}this.allocateTextureUnit=he,this.resetTextureUnits=Q,this.getTextureUnits=se,this.setTextureUnits=de,this.setTexture2D=me,this.setTexture2DArray=xe,this.setTexture3D=Ae,this.setTextureCube=Se,this.rebindTextures=tn,this.setupRenderTarget=hn,this.updateRenderTargetMipmap=k,this.updateMultisampleRenderTarget=Ze,this.setupDepthRenderbuffer=vn,this.setupFrameBufferTexture=Ut,this.useMultisampledRTT=Me,this.dispose=X}function Ew(n,e){function t(i,s=Cs){let r,o=yt.getTransfer(s);if(i===oi)return n.UNSIGNED_BYTE;if(i===Uc)return n.UNSIGNED_SHORT_4_4_4_4;if(i===Oc)return n.UNSIGNED_SHORT_5_5_5_1;if(i===Cd)return n.UNSIGNED_INT_5_9_9_9_REV;if(i===Rd)return n.UNSIGNED_INT_10F_11F_11F_REV;if(i===Ed)return n.BYTE;if(i===Ad)return n.SHORT;if(i===yo)return n.UNSIGNED_SHORT;if(i===Nc)return n.INT;if(i===Fi)return n.UNSIGNED_INT;if(i===ki)return n.FLOAT;if(i===Bi)return n.HALF_FLOAT;if(i===Pd)return n.ALPHA;if(i===Id)return n.RGB;if(i===zi)return n.RGBA;if(i===Ss)return n.DEPTH_COMPONENT;if(i===As)return n.DEPTH_STENCIL;if(i===Ld)return n.RED;if(i===Fc)return n.RED_INTEGER;if(i===er)return n.RG;if(i===kc)return n.RG_INTEGER;if(i===Bc)return n.RGBA_INTEGER;if(i===ka||i===Ba||i===za||i===Va)if(o===Rt)if(r=e.get("WEBGL_compressed_texture_s3tc_srgb"),r!==null){if(i===ka)return r.COMPRESSED_SRGB_S3TC_DXT1_EXT;if(i===Ba)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT1_EXT;if(i===za)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT3_EXT;if(i===Va)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT5_EXT}else return null;else if(r=e.get("WEBGL_compressed_texture_s3tc"),r!==null){if(i===ka)return r.COMPRESSED_RGB_S3TC_DXT1_EXT;if(i===Ba)return r.COMPRESSED_RGBA_S3TC_DXT1_EXT;if(i===za)return r.COMPRESSED_RGBA_S3TC_DXT3_EXT;if(i===Va)return r.COMPRESSED_RGBA_S3TC_DXT5_EXT}else return null;if(i===zc||i===Vc||i===Gc||i===Hc)if(r=e.get("WEBGL_compressed_texture_pvrtc"),r!==null){if(i===zc)return r.COMPRESSED_RGB_PVRTC_4BPPV1_IMG;if(i===Vc)return r.COMPRESSED_RGB_PVRTC_2BPPV1_IMG;if(i===Gc)return r.COMPRESSED_RGBA_PVRTC_4BPPV1_IMG;if(i===Hc)return r.COMPRESSED_RGBA_PVRTC_2BPPV1_IMG}else return null;if(i===Wc||i===Xc||i===qc||i===Yc||i===$c||i===Ga||i===Zc)if(r=e.get("WEBGL_compressed_texture_etc"),r!==null){if(i===Wc||i===Xc)return o===Rt?r.COMPRESSED_SRGB8_ETC2:r.COMPRESSED_RGB8_ETC2;if(i===qc)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ETC2_EAC:r.COMPRESSED_RGBA8_ETC2_EAC;if(i===Yc)return r.COMPRESSED_R11_EAC;if(i===$c)return r.COMPRESSED_SIGNED_R11_EAC;if(i===Ga)return r.COMPRESSED_RG11_EAC;if(i===Zc)return r.COMPRESSED_SIGNED_RG11_EAC}else return null;if(i===Jc||i===Kc||i===jc||i===Qc||i===eu||i===tu||i===nu||i===iu||i===su||i===ru||i===ou||i===au||i===lu||i===cu)if(r=e.get("WEBGL_compressed_texture_astc"),r!==null){if(i===Jc)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR:r.COMPRESSED_RGBA_ASTC_4x4_KHR;if(i===Kc)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_5x4_KHR:r.COMPRESSED_RGBA_ASTC_5x4_KHR;if(i===jc)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_5x5_KHR:r.COMPRESSED_RGBA_ASTC_5x5_KHR;if(i===Qc)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_6x5_KHR:r.COMPRESSED_RGBA_ASTC_6x5_KHR;if(i===eu)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_6x6_KHR:r.COMPRESSED_RGBA_ASTC_6x6_KHR;if(i===tu)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x5_KHR:r.COMPRESSED_RGBA_ASTC_8x5_KHR;if(i===nu)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x6_KHR:r.COMPRESSED_RGBA_ASTC_8x6_KHR;if(i===iu)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x8_KHR:r.COMPRESSED_RGBA_ASTC_8x8_KHR;if(i===su)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x5_KHR:r.COMPRESSED_RGBA_ASTC_10x5_KHR;if(i===ru)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x6_KHR:r.COMPRESSED_RGBA_ASTC_10x6_KHR;if(i===ou)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x8_KHR:r.COMPRESSED_RGBA_ASTC_10x8_KHR;if(i===au)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x10_KHR:r.COMPRESSED_RGBA_ASTC_10x10_KHR;if(i===lu)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_12x10_KHR:r.COMPRESSED_RGBA_ASTC_12x10_KHR;if(i===cu)return o===Rt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_12x12_KHR:r.COMPRESSED_RGBA_ASTC_12x12_KHR}else return null;if(i===uu||i===hu||i===du)if(r=e.get("EXT_texture_compression_bptc"),r!==null){if(i===uu)return o===Rt?r.COMPRESSED_SRGB_ALPHA_BPTC_UNORM_EXT:r.COMPRESSED_RGBA_BPTC_UNORM_EXT;if(i===hu)return r.COMPRESSED_RGB_BPTC_SIGNED_FLOAT_EXT;if(i===du)return r.COMPRESSED_RGB_BPTC_UNSIGNED_FLOAT_EXT}else return null;if(i===fu||i===pu||i===Ha||i===mu)if(r=e.get("EXT_texture_compression_rgtc"),r!==null){if(i===fu)return r.COMPRESSED_RED_RGTC1_EXT;if(i===pu)return r.COMPRESSED_SIGNED_RED_RGTC1_EXT;if(i===Ha)return r.COMPRESSED_RED_GREEN_RGTC2_EXT;if(i===mu)return r.COMPRESSED_SIGNED_RED_GREEN_RGTC2_EXT}else return null;return i===_r?n.UNSIGNED_INT_24_8:n[i]!==void 0?n[i]:null}return{convert:t}}var Aw=`
void main() {

	gl_Position = vec4( position, 1.0 );

}`,Cw=`
uniform sampler2DArray depthColor;
uniform float depthWidth;
uniform float depthHeight;

void main() {

	vec2 coord = vec2( gl_FragCoord.x / depthWidth, gl_FragCoord.y / depthHeight );

	if ( coord.x >= 1.0 ) {

		gl_FragDepth = texture( depthColor, vec3( coord.x - 1.0, coord.y, 1 ) ).r;

	} else {

		gl_FragDepth = texture( depthColor, vec3( coord.x, coord.y, 0 ) ).r;

	}

}`,tf=class{constructor(){this.texture=null,this.mesh=null,this.depthNear=0,this.depthFar=0}init(e,t){if(this.texture===null){let i=new Ma(e.texture);(e.depthNear!==t.depthNear||e.depthFar!==t.depthFar)&&(this.depthNear=e.depthNear,this.depthFar=e.depthFar),this.texture=i}}getMesh(e){if(this.texture!==null&&this.mesh===null){let t=e.cameras[0].viewport,i=new ts({vertexShader:Aw,fragmentShader:Cw,uniforms:{depthColor:{value:this.texture},depthWidth:{value:t.z},depthHeight:{value:t.w}}});this.mesh=new ri(new Ea(20,20),i)}return this.mesh}reset(){this.texture=null,this.mesh=null}getDepthTexture(){return this.texture}},nf=class extends Ui{constructor(e,t){super();let i=this,s=null,r=1,o=null,a="local-floor",l=1,c=null,u=null,d=null,h=null,f=null,m=null,y=typeof XRWebGLBinding<"u",g=new tf,_={},b=t.getContextAttributes(),C=null,S=null,P=[],A=[],x=new qe,w=null,F=null,D=new jn;D.viewport=new jt;let L=new jn;L.viewport=new jt;let B=[D,L],V=new Pc,U=null,X=null;this.cameraAutoUpdate=!0,this.enabled=!1,this.isPresenting=!1,this.getController=function(ee){let me=P[ee];return me===void 0&&(me=new ao,P[ee]=me),me.getTargetRaySpace()},this.getControllerGrip=function(ee){let me=P[ee];return me===void 0&&(me=new ao,P[ee]=me),me.getGripSpace()},this.getHand=function(ee){let me=P[ee];return me===void 0&&(me=new ao,P[ee]=me),me.getHandSpace()};function $(ee){let me=A.indexOf(ee.inputSource);if(me===-1)return;let xe=P[me];xe!==void 0&&(xe.update(ee.inputSource,ee.frame,c||o),xe.dispatchEvent({type:ee.type,data:ee.inputSource}))}function W(){s.removeEventListener("select",$),s.removeEventListener("selectstart",$),s.removeEventListener("selectend",$),s.removeEventListener("squeeze",$),s.removeEventListener("squeezestart",$),s.removeEventListener("squeezeend",$),s.removeEventListener("end",W),s.removeEventListener("inputsourceschange",ce);for(let ee=0;ee<P.length;ee++){let me=A[ee];me!==null&&(A[ee]=null,P[ee].disconnect(me))}U=null,X=null,g.reset();for(let ee in _)delete _[ee];if(e.setRenderTarget(C),f=null,h=null,d=null,s=null,S=null,he.stop(),i.isPresenting=!1,e.setPixelRatio(w),e.setSize(x.width,x.height,!1),F!==null){let ee=F.camera;ee.fov=F.fov,ee.zoom=F.zoom,ee.updateProjectionMatrix(),F=null}i.dispatchEvent({type:"sessionend"})}this.setFramebufferScaleFactor=function(ee){r=ee,i.isPresenting===!0&&$e("WebXRManager: Cannot change framebuffer scale while presenting.")},this.setReferenceSpaceType=function(ee){a=ee,i.isPresenting===!0&&$e("WebXRManager: Cannot change reference space type while presenting.")},this.getReferenceSpace=function(){return c||o},this.setReferenceSpace=function(ee){c=ee},this.getBaseLayer=function(){return h!==null?h:f},this.getBinding=function(){return d===null&&y&&(d=new XRWebGLBinding(s,t)),d},this.getFrame=function(){return m},this.getSession=function(){return s},this.setSession=async function(ee){if(s=ee,s!==null){if(C=e.getRenderTarget(),s.addEventListener("select",$),s.addEventListener("selectstart",$),s.addEventListener("selectend",$),s.addEventListener("squeeze",$),s.addEventListener("squeezestart",$),s.addEventListener("squeezeend",$),s.addEventListener("end",W),s.addEventListener("inputsourceschange",ce),b.xrCompatible!==!0&&await t.makeXRCompatible(),w=e.getPixelRatio(),e.getSize(x),y&&"createProjectionLayer"in XRWebGLBinding.prototype){let xe=null,Ae=null,Se=null;b.depth&&(Se=b.stencil?t.DEPTH24_STENCIL8:t.DEPTH_COMPONENT24,xe=b.stencil?As:Ss,Ae=b.stencil?_r:Fi);let We={colorFormat:t.RGBA8,depthFormat:Se,scaleFactor:r};d=this.getBinding(),h=d.createProjectionLayer(We),s.updateRenderState({layers:[h]}),e.setPixelRatio(1),e.setSize(h.textureWidth,h.textureHeight,!1),S=new mi(h.textureWidth,h.textureHeight,{format:zi,type:oi,depthTexture:new ws(h.textureWidth,h.textureHeight,Ae,void 0,void 0,void 0,void 0,void 0,void 0,xe),stencilBuffer:b.stencil,colorSpace:e.outputColorSpace,samples:b.antialias?4:0,resolveDepthBuffer:h.ignoreDepthValues===!1,resolveStencilBuffer:h.ignoreDepthValues===!1,storeMultisampledDepthBuffer:h.ignoreDepthValues===!1,storeMultisampledStencilBuffer:h.ignoreDepthValues===!1})}else{let xe={antialias:b.antialias,alpha:!0,depth:b.depth,stencil:b.stencil,framebufferScaleFactor:r};f=new XRWebGLLayer(s,t,xe),s.updateRenderState({baseLayer:f}),e.setPixelRatio(1),e.setSize(f.framebufferWidth,f.framebufferHeight,!1),S=new mi(f.framebufferWidth,f.framebufferHeight,{format:zi,type:oi,colorSpace:e.outputColorSpace,stencilBuffer:b.stencil,resolveDepthBuffer:f.ignoreDepthValues===!1,resolveStencilBuffer:f.ignoreDepthValues===!1,storeMultisampledDepthBuffer:f.ignoreDepthValues===!1,storeMultisampledStencilBuffer:f.ignoreDepthValues===!1})}S.isXRRenderTarget=!0,this.setFoveation(l),c=null,o=await s.requestReferenceSpace(a),he.setContext(s),he.start(),i.isPresenting=!0,i.dispatchEvent({type:"sessionstart"})}},this.getEnvironmentBlendMode=function(){if(s!==null)return s.environmentBlendMode},this.getDepthTexture=function(){return g.getDepthTexture()};function ce(ee){for(let me=0;me<ee.removed.length;me++){let xe=ee.removed[me],Ae=A.indexOf(xe);Ae>=0&&(A[Ae]=null,P[Ae].disconnect(xe))}for(let me=0;me<ee.added.length;me++){let xe=ee.added[me],Ae=A.indexOf(xe);if(Ae===-1){for(let We=0;We<P.length;We++)if(We>=A.length){A.push(xe),Ae=We;break}else if(A[We]===null){A[We]=xe,Ae=We;break}if(Ae===-1)break}let Se=P[Ae];Se&&Se.connect(xe)}}function K(ee,me){me===null?ee.matrixWorld.copy(ee.matrix):ee.matrixWorld.multiplyMatrices(me.matrixWorld,ee.matrix),ee.matrixWorldInverse.copy(ee.matrixWorld).invert()}this.updateCamera=function(ee){if(s===null)return;let me=ee.near,xe=ee.far;g.texture!==null&&(g.depthNear>0&&(me=g.depthNear),g.depthFar>0&&(xe=g.depthFar)),V.near=L.near=D.near=me,V.far=L.far=D.far=xe,(U!==V.near||X!==V.far)&&(s.updateRenderState({depthNear:V.near,depthFar:V.far}),U=V.near,X=V.far),V.layers.mask=ee.layers.mask|6,D.layers.mask=V.layers.mask&-5,L.layers.mask=V.layers.mask&-3;let Ae=ee.parent,Se=V.cameras;K(V,Ae);for(let We=0;We<Se.length;We++)K(Se[We],Ae);V.projectionMatrix.copy(D.projectionMatrix),V.projectionMatrixInverse.copy(D.projectionMatrixInverse),F===null&&ee.isPerspectiveCamera&&(F={camera:ee,fov:ee.fov,zoom:ee.zoom}),Q(ee,V,Ae)};function Q(ee,me,xe){xe===null?ee.matrix.copy(me.matrixWorld):(ee.matrix.copy(xe.matrixWorld),ee.matrix.invert(),ee.matrix.multiply(me.matrixWorld)),ee.matrix.decompose(ee.position,ee.quaternion,ee.scale),ee.updateMatrixWorld(!0),ee.projectionMatrix.copy(me.projectionMatrix),ee.projectionMatrixInverse.copy(me.projectionMatrixInverse),ee.isPerspectiveCamera&&(ee.fov=ro*2*Math.atan(1/ee.projectionMatrix.elements[5]),ee.zoom=1)}this.getCamera=function(){return V},this.getFoveation=function(){if(!(h===null&&f===null))return l},this.setFoveation=function(ee){l=ee,h!==null&&(h.fixedFoveation=ee),f!==null&&f.fixedFoveation!==void 0&&(f.fixedFoveation=ee)},this.hasDepthSensing=function(){return g.texture!==null},this.getDepthSensingMesh=function(){return g.getMesh(V)},this.getCameraTexture=function(ee){return _[ee]};let se=null;function de(ee,me){if(u=me.getViewerPose(c||o),m=me,u!==null){let xe=u.views;f!==null&&(e.setRenderTargetFramebuffer(S,f.framebuffer),e.setRenderTarget(S));let Ae=!1;xe.length!==V.cameras.length&&(V.cameras.length=0,Ae=!0);for(let Ge=0;Ge<xe.length;Ge++){let dt=xe[Ge],ct=null;if(f!==null)ct=f.getViewport(dt);else{let Zt=d.getViewSubImage(h,dt);ct=Zt.viewport,Ge===0&&(e.setRenderTargetTextures(S,Zt.colorTexture,Zt.depthStencilTexture),e.setRenderTarget(S))}let it=B[Ge];it===void 0&&(it=new jn,it.layers.enable(Ge),it.viewport=new jt,B[Ge]=it),it.matrix.fromArray(dt.transform.matrix),it.matrix.decompose(it.position,it.quaternion,it.scale),it.projectionMatrix.fromArray(dt.projectionMatrix),it.projectionMatrixInverse.copy(it.projectionMatrix).invert(),it.viewport.set(ct.x,ct.y,ct.width,ct.height),Ge===0&&(V.matrix.copy(it.matrix),V.matrix.decompose(V.position,V.quaternion,V.scale)),Ae===!0&&V.cameras.push(it)}let Se=s.enabledFeatures;if(Se&&Se.includes("depth-sensing")&&s.depthUsage=="gpu-optimized"&&y){d=i.getBinding();let Ge=d.getDepthInformation(xe[0]);Ge&&Ge.isValid&&Ge.texture&&g.init(Ge,s.renderState)}if(Se&&Se.includes("camera-access")&&y){e.state.unbindTexture(),d=i.getBinding();for(let Ge=0;Ge<xe.length;Ge++){let dt=xe[Ge].camera;if(dt){let ct=_[dt];ct||(ct=new Ma,_[dt]=ct);let it=d.getCameraImage(dt);ct.sourceTexture=it}}}}for(let xe=0;xe<P.length;xe++){let Ae=A[xe],Se=P[xe];Ae!==null&&Se!==void 0&&Se.update(Ae,me,c||o)}se&&se(ee,me),me.detectedPlanes&&i.dispatchEvent({type:"planesdetected",data:me}),m=null}let he=new Vg;he.setAnimationLoop(de),this.setAnimationLoop=function(ee){se=ee},this.dispose=function(){}}},Rw=new Bt,Kg=new nt;Kg.set(-1,0,0,0,1,0,0,0,1);function Pw(n,e){function t(g,_){g.matrixAutoUpdate===!0&&g.updateMatrix(),_.value.copy(g.matrix)}function i(g,_){_.color.getRGB(g.fogColor.value,Hd(n)),_.isFog?(g.fogNear.value=_.near,g.fogFar.value=_.far):_.isFogExp2&&(g.fogDensity.value=_.density)}function s(g,_,b,C,S){_.isNodeMaterial?_.uniformsNeedUpdate=!1:_.isMeshBasicMaterial?r(g,_):_.isMeshLambertMaterial?(r(g,_),_.envMap&&(g.envMapIntensity.value=_.envMapIntensity)):_.isMeshToonMaterial?(r(g,_),d(g,_)):_.isMeshPhongMaterial?(r(g,_),u(g,_),_.envMap&&(g.envMapIntensity.value=_.envMapIntensity)):_.isMeshStandardMaterial?(r(g,_),h(g,_),_.isMeshPhysicalMaterial&&f(g,_,S)):_.isMeshMatcapMaterial?(r(g,_),m(g,_)):_.isMeshDepthMaterial?r(g,_):_.isMeshDistanceMaterial?(r(g,_),y(g,_)):_.isMeshNormalMaterial?r(g,_):_.isLineBasicMaterial?(o(g,_),_.isLineDashedMaterial&&a(g,_)):_.isPointsMaterial?l(g,_,b,C):_.isSpriteMaterial?c(g,_):_.isShadowMaterial?(g.color.value.copy(_.color),g.opacity.value=_.opacity):_.isShaderMaterial&&(_.uniformsNeedUpdate=!1)}function r(g,_){g.opacity.value=_.opacity,_.color&&g.diffuse.value.copy(_.color),_.emissive&&g.emissive.value.copy(_.emissive).multiplyScalar(_.emissiveIntensity),_.map&&(g.map.value=_.map,t(_.map,g.mapTransform)),_.alphaMap&&(g.alphaMap.value=_.alphaMap,t(_.alphaMap,g.alphaMapTransform)),_.bumpMap&&(g.bumpMap.value=_.bumpMap,t(_.bumpMap,g.bumpMapTransform),g.bumpScale.value=_.bumpScale,_.side===ti&&(g.bumpScale.value*=-1)),_.normalMap&&(g.normalMap.value=_.normalMap,t(_.normalMap,g.normalMapTransform),g.normalScale.value.copy(_.normalScale),_.side===ti&&g.normalScale.value.negate()),_.displacementMap&&(g.displacementMap.value=_.displacementMap,t(_.displacementMap,g.displacementMapTransform),g.displacementScale.value=_.displacementScale,g.displacementBias.value=_.displacementBias),_.emissiveMap&&(g.emissiveMap.value=_.emissiveMap,t(_.emissiveMap,g.emissiveMapTransform)),_.specularMap&&(g.specularMap.value=_.specularMap,t(_.specularMap,g.specularMapTransform)),_.alphaTest>0&&(g.alphaTest.value=_.alphaTest);let b=e.get(_),C=b.envMap,S=b.envMapRotation;C&&(g.envMap.value=C,g.envMapRotation.value.setFromMatrix4(Rw.makeRotationFromEuler(S)).transpose(),C.isCubeTexture&&C.isRenderTargetTexture===!1&&g.envMapRotation.value.premultiply(Kg),g.reflectivity.value=_.reflectivity,g.ior.value=_.ior,g.refractionRatio.value=_.refractionRatio),_.lightMap&&(g.lightMap.value=_.lightMap,g.lightMapIntensity.value=_.lightMapIntensity,t(_.lightMap,g.lightMapTransform)),_.aoMap&&(g.aoMap.value=_.aoMap,g.aoMapIntensity.value=_.aoMapIntensity,t(_.aoMap,g.aoMapTransform))}function o(g,_){g.diffuse.value.copy(_.color),g.opacity.value=_.opacity,_.map&&(g.map.value=_.map,t(_.map,g.mapTransform))}function a(g,_){g.dashSize.value=_.dashSize,g.totalSize.value=_.dashSize+_.gapSize,g.scale.value=_.scale}function l(g,_,b,C){g.diffuse.value.copy(_.color),g.opacity.value=_.opacity,g.size.value=_.size*b,g.scale.value=C*.5,_.map&&(g.map.value=_.map,t(_.map,g.uvTransform)),_.alphaMap&&(g.alphaMap.value=_.alphaMap,t(_.alphaMap,g.alphaMapTransform)),_.alphaTest>0&&(g.alphaTest.value=_.alphaTest)}function c(g,_){g.diffuse.value.copy(_.color),g.opacity.value=_.opacity,g.rotation.value=_.rotation,_.map&&(g.map.value=_.map,t(_.map,g.mapTransform)),_.alphaMap&&(g.alphaMap.value=_.alphaMap,t(_.alphaMap,g.alphaMapTransform)),_.alphaTest>0&&(g.alphaTest.value=_.alphaTest)}function u(g,_){g.specular.value.copy(_.specular),g.shininess.value=Math.max(_.shininess,1e-4)}function d(g,_){_.gradientMap&&(g.gradientMap.value=_.gradientMap)}function h(g,_){g.metalness.value=_.metalness,_.metalnessMap&&(g.metalnessMap.value=_.metalnessMap,t(_.metalnessMap,g.metalnessMapTransform)),g.roughness.value=_.roughness,_.roughnessMap&&(g.roughnessMap.value=_.roughnessMap,t(_.roughnessMap,g.roughnessMapTransform)),_.envMap&&(g.envMapIntensity.value=_.envMapIntensity)}function f(g,_,b){g.ior.value=_.ior,_.diffuseRoughness>0&&(g.diffuseRoughness.value=_.diffuseRoughness,_.diffuseRoughnessMap&&(g.diffuseRoughnessMap.value=_.diffuseRoughnessMap,t(_.diffuseRoughnessMap,g.diffuseRoughnessMapTransform))),_.sheen>0&&(g.sheenColor.value.copy(_.sheenColor).multiplyScalar(_.sheen),g.sheenRoughness.value=_.sheenRoughness,_.sheenColorMap&&(g.sheenColorMap.value=_.sheenColorMap,t(_.sheenColorMap,g.sheenColorMapTransform)),_.sheenRoughnessMap&&(g.sheenRoughnessMap.value=_.sheenRoughnessMap,t(_.sheenRoughnessMap,g.sheenRoughnessMapTransform))),_.clearcoat>0&&(g.clearcoat.value=_.clearcoat,g.clearcoatRoughness.value=_.clearcoatRoughness,_.clearcoatMap&&(g.clearcoatMap.value=_.clearcoatMap,t(_.clearcoatMap,g.clearcoatMapTransform)),_.clearcoatRoughnessMap&&(g.clearcoatRoughnessMap.value=_.clearcoatRoughnessMap,t(_.clearcoatRoughnessMap,g.clearcoatRoughnessMapTransform)),_.clearcoatNormalMap&&(g.clearcoatNormalMap.value=_.clearcoatNormalMap,t(_.clearcoatNormalMap,g.clearcoatNormalMapTransform),g.clearcoatNormalScale.value.copy(_.clearcoatNormalScale),_.side===ti&&g.clearcoatNormalScale.value.negate())),_.dispersion>0&&(g.dispersion.value=_.dispersion),_.retroreflectivity>0&&(g.retroreflectivity.value=_.retroreflectivity),_.iridescence>0&&(g.iridescence.value=_.iridescence,g.iridescenceIOR.value=_.iridescenceIOR,g.iridescenceThicknessMinimum.value=_.iridescenceThicknessMinimum,g.iridescenceThicknessMaximum.value=_.iridescenceThicknessMaximum,_.iridescenceMap&&(g.iridescenceMap.value=_.iridescenceMap,t(_.iridescenceMap,g.iridescenceMapTransform)),_.iridescenceThicknessMap&&(g.iridescenceThicknessMap.value=_.iridescenceThicknessMap,t(_.iridescenceThicknessMap,g.iridescenceThicknessMapTransform))),_.transmission>0&&(g.transmission.value=_.transmission,g.transmissionSamplerMap.value=b.texture,g.transmissionSamplerSize.value.set(b.width,b.height),_.transmissionMap&&(g.transmissionMap.value=_.transmissionMap,t(_.transmissionMap,g.transmissionMapTransform)),g.thickness.value=_.thickness,_.thicknessMap&&(g.thicknessMap.value=_.thicknessMap,t(_.thicknessMap,g.thicknessMapTransform)),g.attenuationDistance.value=_.attenuationDistance,g.attenuationColor.value.copy(_.attenuationColor)),_.anisotropy>0&&(g.anisotropyVector.value.set(_.anisotropy*Math.cos(_.anisotropyRotation),_.anisotropy*Math.sin(_.anisotropyRotation)),_.anisotropyMap&&(g.anisotropyMap.value=_.anisotropyMap,t(_.anisotropyMap,g.anisotropyMapTransform))),g.specularIntensity.value=_.specularIntensity,g.specularColor.value.copy(_.specularColor),_.specularColorMap&&(g.specularColorMap.value=_.specularColorMap,t(_.specularColorMap,g.specularColorMapTransform)),_.specularIntensityMap&&(g.specularIntensityMap.value=_.specularIntensityMap,t(_.specularIntensityMap,g.specularIntensityMapTransform))}function m(g,_){_.matcap&&(g.matcap.value=_.matcap)}function y(g,_){let b=e.get(_).light;g.referencePosition.value.setFromMatrixPosition(b.matrixWorld),g.nearDistance.value=b.shadow.camera.near,g.farDistance.value=b.shadow.camera.far}return{refreshFogUniforms:i,refreshMaterialUniforms:s}}function Iw(n,e,t,i){let s={},r={};function o(b,C){let S=C.program;i.uniformBlockBinding(b,S,s[b.id])}function a(b,C){let S=s[b.id];S===void 0&&(m(b),S=l(b),s[b.id]=S,b.addEventListener("dispose",g));let P=C.program;i.updateUBOMapping(b,P);let A=e.render.frame;r[b.id]!==A&&(c(b),r[b.id]=A)}function l(b){let C=n.createBuffer(),S=b.__size,P=b.usage;return n.bindBuffer(n.UNIFORM_BUFFER,C),n.bufferData(n.UNIFORM_BUFFER,S,P),n.bindBuffer(n.UNIFORM_BUFFER,null),C}function c(b){let C=s[b.id],S=b.uniforms,P=b.__cache;n.bindBuffer(n.UNIFORM_BUFFER,C);for(let A=0,x=S.length;A<x;A++){let w=S[A];if(Array.isArray(w))for(let F=0,D=w.length;F<D;F++)u(w[F],A,F,P);else u(w,A,0,P)}n.bindBuffer(n.UNIFORM_BUFFER,null)}function u(b,C,S,P){if(h(b,C,S,P)===!0){let A=b.__offset,x=b.value;if(Array.isArray(x)){let w=0;for(let F=0;F<x.length;F++){let D=x[F],L=y(D,!0);d(D,b.__data,w),w+=L.storage/Float32Array.BYTES_PER_ELEMENT}}else d(x,b.__data,0);n.bufferSubData(n.UNIFORM_BUFFER,A,b.__data)}}function d(b,C,S){typeof b=="number"||typeof b=="boolean"?C[S]=b:b.isMatrix3?(C[S]=b.elements[0],C[S+1]=b.elements[1],C[S+2]=b.elements[2],C[S+3]=0,C[S+4]=b.elements[3],C[S+5]=b.elements[4],C[S+6]=b.elements[5],C[S+7]=0,C[S+8]=b.elements[6],C[S+9]=b.elements[7],C[S+10]=b.elements[8],C[S+11]=0):ArrayBuffer.isView(b)?C.set(b.subarray(0,C.length-S),S):b.toArray(C,S)}function h(b,C,S,P){let A=b.value,x=C+"_"+S;if(Array.isArray(A)){P[x]===void 0&&(P[x]=[]);let w=P[x],F=!1;for(let D=0;D<A.length;D++)f(A[D],w,D)===!0&&(F=!0);return F}return f(A,P,x)}function f(b,C,S){if(C[S]===void 0)return typeof b=="number"||typeof b=="boolean"?C[S]=b:ArrayBuffer.isView(b)?C[S]=b.slice():C[S]=b.clone(),!0;{let P=C[S];if(typeof b=="number"||typeof b=="boolean"){if(P!==b)return C[S]=b,!0}else{if(ArrayBuffer.isView(b))return!0;if(P.equals(b)===!1)return P.copy(b),!0}}return!1}function m(b){let C=b.uniforms,S=0,P=16;for(let x=0,w=C.length;x<w;x++){let F=Array.isArray(C[x])?C[x]:[C[x]];for(let D=0,L=F.length;D<L;D++){let B=F[D],V=Array.isArray(B.value)?B.value:[B.value],U=Array.isArray(C[x])||Array.isArray(B.value),X=S;for(let W=0,ce=V.length;W<ce;W++){let K=V[W],Q=y(K,U),se=S%P,de=se%Q.boundary,he=se+de;S+=de,he!==0&&P-he<Q.storage&&(S+=P-he),W===0&&(X=S),S+=Q.storage}let $=B.type==="int"?Int32Array:B.type==="uint"?Uint32Array:Float32Array;B.__data=new $((S-X)/Float32Array.BYTES_PER_ELEMENT),B.__offset=X}}let A=S%P;return A>0&&(S+=P-A),b.__size=S,b.__cache={},this}function y(b,C){let S={boundary:0,storage:0};return typeof b=="number"||typeof b=="boolean"?(S.boundary=4,S.storage=4):b.isVector2?(S.boundary=8,S.storage=8):b.isVector3||b.isColor?(S.boundary=16,S.storage=12):b.isVector4?(S.boundary=16,S.storage=16):b.isMatrix3?(S.boundary=16,S.storage=48):b.isMatrix4?(S.boundary=16,S.storage=64):b.isTexture?$e("WebGLRenderer: Texture samplers can not be part of an uniforms group."):ArrayBuffer.isView(b)?(S.boundary=16,S.storage=b.byteLength):$e("WebGLRenderer: Unsupported uniform value type.",b),C===!0&&(S.boundary=16,S.storage=Math.ceil(S.storage/16)*16),S}function g(b){let C=b.target;C.removeEventListener("dispose",g),n.deleteBuffer(s[C.id]),delete s[C.id],delete r[C.id]}function _(){for(let b in s)n.deleteBuffer(s[b]);s={},r={}}return{bind:o,update:a,dispose:_}}var Lw=new Uint16Array([12469,15057,12620,14925,13266,14620,13807,14376,14323,13990,14545,13625,14713,13328,14840,12882,14931,12528,14996,12233,15039,11829,15066,11525,15080,11295,15085,10976,15082,10705,15073,10495,13880,14564,13898,14542,13977,14430,14158,14124,14393,13732,14556,13410,14702,12996,14814,12596,14891,12291,14937,11834,14957,11489,14958,11194,14943,10803,14921,10506,14893,10278,14858,9960,14484,14039,14487,14025,14499,13941,14524,13740,14574,13468,14654,13106,14743,12678,14818,12344,14867,11893,14889,11509,14893,11180,14881,10751,14852,10428,14812,10128,14765,9754,14712,9466,14764,13480,14764,13475,14766,13440,14766,13347,14769,13070,14786,12713,14816,12387,14844,11957,14860,11549,14868,11215,14855,10751,14825,10403,14782,10044,14729,9651,14666,9352,14599,9029,14967,12835,14966,12831,14963,12804,14954,12723,14936,12564,14917,12347,14900,11958,14886,11569,14878,11247,14859,10765,14828,10401,14784,10011,14727,9600,14660,9289,14586,8893,14508,8533,15111,12234,15110,12234,15104,12216,15092,12156,15067,12010,15028,11776,14981,11500,14942,11205,14902,10752,14861,10393,14812,9991,14752,9570,14682,9252,14603,8808,14519,8445,14431,8145,15209,11449,15208,11451,15202,11451,15190,11438,15163,11384,15117,11274,15055,10979,14994,10648,14932,10343,14871,9936,14803,9532,14729,9218,14645,8742,14556,8381,14461,8020,14365,7603,15273,10603,15272,10607,15267,10619,15256,10631,15231,10614,15182,10535,15118,10389,15042,10167,14963,9787,14883,9447,14800,9115,14710,8665,14615,8318,14514,7911,14411,7507,14279,7198,15314,9675,15313,9683,15309,9712,15298,9759,15277,9797,15229,9773,15166,9668,15084,9487,14995,9274,14898,8910,14800,8539,14697,8234,14590,7790,14479,7409,14367,7067,14178,6621,15337,8619,15337,8631,15333,8677,15325,8769,15305,8871,15264,8940,15202,8909,15119,8775,15022,8565,14916,8328,14804,8009,14688,7614,14569,7287,14448,6888,14321,6483,14088,6171,15350,7402,15350,7419,15347,7480,15340,7613,15322,7804,15287,7973,15229,8057,15148,8012,15046,7846,14933,7611,14810,7357,14682,7069,14552,6656,14421,6316,14251,5948,14007,5528,15356,5942,15356,5977,15353,6119,15348,6294,15332,6551,15302,6824,15249,7044,15171,7122,15070,7050,14949,6861,14818,6611,14679,6349,14538,6067,14398,5651,14189,5311,13935,4958,15359,4123,15359,4153,15356,4296,15353,4646,15338,5160,15311,5508,15263,5829,15188,6042,15088,6094,14966,6001,14826,5796,14678,5543,14527,5287,14377,4985,14133,4586,13869,4257,15360,1563,15360,1642,15358,2076,15354,2636,15341,3350,15317,4019,15273,4429,15203,4732,15105,4911,14981,4932,14836,4818,14679,4621,14517,4386,14359,4156,14083,3795,13808,3437,15360,122,15360,137,15358,285,15355,636,15344,1274,15322,2177,15281,2765,15215,3223,15120,3451,14995,3569,14846,3567,14681,3466,14511,3305,14344,3121,14037,2800,13753,2467,15360,0,15360,1,15359,21,15355,89,15346,253,15325,479,15287,796,15225,1148,15133,1492,15008,1749,14856,1882,14685,1886,14506,1783,14324,1608,13996,1398,13702,1183]),ss=null;function Dw(){return ss===null&&(ss=new hc(Lw,16,16,er,Bi),ss.name="DFG_LUT",ss.minFilter=Qn,ss.magFilter=Qn,ss.wrapS=Qi,ss.wrapT=Qi,ss.generateMipmaps=!1,ss.needsUpdate=!0),ss}var bu=class{constructor(e={}){let{canvas:t=hg(),context:i=null,depth:s=!0,stencil:r=!1,alpha:o=!1,antialias:a=!1,premultipliedAlpha:l=!0,preserveDrawingBuffer:c=!1,powerPreference:u="default",failIfMajorPerformanceCaveat:d=!1,reversedDepthBuffer:h=!1,outputBufferType:f=oi}=e;this.isWebGLRenderer=!0;let m;if(i!==null){if(typeof WebGLRenderingContext<"u"&&i instanceof WebGLRenderingContext)throw new Error("THREE.WebGLRenderer: WebGL 1 is not supported since r163.");m=i.getContextAttributes().alpha}else m=o;let y=f,g=new Set([Bc,kc,Fc]),_=new Set([oi,Fi,yo,_r,Uc,Oc]),b=new Uint32Array(4),C=new Int32Array(4),S={textures:[],min:[],max:[],resolution:[]},P=null,A=null,x=[],w=[],F=null;this.domElement=t,this.debug={checkShaderErrors:!0,diagnostics:{keywords:!1},onShaderError:null},this.autoClear=!0,this.autoClearColor=!0,this.autoClearDepth=!0,this.autoClearStencil=!0,this.sortObjects=!0,this.clippingPlanes=[],this.localClippingEnabled=!1,this.toneMapping=is,this.toneMappingExposure=1,this.transmissionResolutionScale=1;let D=this,L=!1,B=null,V=null,U=null,X=null;this._outputColorSpace=Kn;let $=0,W=0,ce=null,K=-1,Q=null,se=new jt,de=new jt,he=null,ee=new tt(0),me=0,xe=t.width,Ae=t.height,Se=1,We=null,ot=null,Ge=new jt(0,0,xe,Ae),dt=new jt(0,0,xe,Ae),ct=!1,it=new Ys,Zt=new dc,Gt=!1,un=!1,Ut=new Bt,Cn=new H,St=new jt,vn={background:null,fog:null,environment:null,overrideMaterial:null,isScene:!0},tn=!1;function hn(){return ce===null?Se:1}let k=i;function Re(E,z){return t.getContext(E,z)}let Ze,at,Me,Ft,Ve,Ye,R,M,q,ue,oe,_e,ve,te,ie,pe,O,re,ne,we,ge,be,He;try{let E={alpha:!0,depth:s,stencil:r,antialias:a,premultipliedAlpha:l,preserveDrawingBuffer:c,powerPreference:u,failIfMajorPerformanceCaveat:d};if("setAttribute"in t&&t.setAttribute("data-engine",`three.js r${"187"}`),t.addEventListener("webglcontextlost",ke,!1),t.addEventListener("webglcontextrestored",je,!1),t.addEventListener("webglcontextcreationerror",Ce,!1),k===null){let z="webgl2";if(k=Re(z,E),k===null)throw Re(z)?new Error("THREE.WebGLRenderer: Error creating WebGL context with your selected attributes."):new Error("THREE.WebGLRenderer: Error creating WebGL context.")}Ke()}catch(E){throw t.removeEventListener("webglcontextlost",ke,!1),t.removeEventListener("webglcontextrestored",je,!1),t.removeEventListener("webglcontextcreationerror",Ce,!1),Qe("WebGLRenderer: "+E.message),E}function Ke(){Ze=new WS(k),Ze.init(),ge=new Ew(k,Ze),at=new DS(k,Ze,e,ge),Me=new ww(k,Ze),at.reversedDepthBuffer&&h&&Me.buffers.depth.setReversed(!0),V=k.createFramebuffer(),U=k.createFramebuffer(),X=k.createFramebuffer(),Ft=new YS(k),Ve=new uw,Ye=new Tw(k,Ze,Me,Ve,at,ge,Ft),R=new HS(D),M=new Zv(k),be=new IS(k,M),q=new XS(k,M,Ft,be),ue=new ZS(k,q,M,be,Ft),re=new $S(k,at,Ye),ie=new NS(Ve),oe=new cw(D,R,Ze,at,be,ie),_e=new Pw(D,Ve),ve=new dw,te=new xw(Ze),O=new PS(D,R,Me,ue,m,l),pe=new Mw(D,ue,at),He=new Iw(k,Ft,at,Me),ne=new LS(k,Ze,Ft),we=new qS(k,Ze,Ft),Ft.programs=oe.programs,D.capabilities=at,D.extensions=Ze,D.properties=Ve,D.renderLists=ve,D.shadowMap=pe,D.state=Me,D.info=Ft}y!==oi&&(F=new KS(y,t.width,t.height,a,s,r));let le=new nf(D,k);this.xr=le,this.getContext=function(){return k},this.getContextAttributes=function(){return k.getContextAttributes()},this.forceContextLoss=function(){let E=Ze.get("WEBGL_lose_context");E&&E.loseContext()},this.forceContextRestore=function(){let E=Ze.get("WEBGL_lose_context");E&&E.restoreContext()},this.getPixelRatio=function(){return Se},this.setPixelRatio=function(E){E!==void 0&&(Se=E,this.setSize(xe,Ae,!1))},this.getSize=function(E){return E.set(xe,Ae)},this.setSize=function(E,z,j=!0){if(le.isPresenting){$e("WebGLRenderer: Can't change size while VR device is presenting.");return}xe=E,Ae=z,t.width=Math.floor(E*Se),t.height=Math.floor(z*Se),j===!0&&(t.style.width=E+"px",t.style.height=z+"px"),F!==null&&F.setSize(t.width,t.height),this.setViewport(0,0,E,z)},this.getDrawingBufferSize=function(E){return E.set(xe*Se,Ae*Se).floor()},this.setDrawingBufferSize=function(E,z,j){xe=E,Ae=z,Se=j,t.width=Math.floor(E*j),t.height=Math.floor(z*j),this.setViewport(0,0,E,z)},this.setEffects=function(E){if(y===oi){Qe("WebGLRenderer: setEffects() requires outputBufferType set to HalfFloatType or FloatType.");return}if(E){for(let z=0;z<E.length;z++)if(E[z].isOutputPass===!0){$e("WebGLRenderer: OutputPass is not needed in setEffects(). Tone mapping and color space conversion are applied automatically.");break}}F.setEffects(E||[])},this.getCurrentViewport=function(E){return E.copy(se)},this.getViewport=function(E){return E.copy(Ge)},this.setViewport=function(E,z,j,Y){E.isVector4?Ge.set(E.x,E.y,E.z,E.w):Ge.set(E,z,j,Y),Me.viewport(se.copy(Ge).multiplyScalar(hn()).round())},this.getScissor=function(E){return E.copy(dt)},this.setScissor=function(E,z,j,Y){E.isVector4?dt.set(E.x,E.y,E.z,E.w):dt.set(E,z,j,Y),Me.scissor(de.copy(dt).multiplyScalar(hn()).round())},this.getScissorTest=function(){return ct},this.setScissorTest=function(E){Me.setScissorTest(ct=E)},this.setOpaqueSort=function(E){We=E},this.setTransparentSort=function(E){ot=E},this.getClearColor=function(E){return E.copy(O.getClearColor())},this.setClearColor=function(){O.setClearColor(...arguments)},this.getClearAlpha=function(){return O.getClearAlpha()},this.setClearAlpha=function(){O.setClearAlpha(...arguments)},this.clear=function(E=!0,z=!0,j=!0){let Y=0;if(E){let Z=!1;if(ce!==null){let Te=ce.texture.format;Z=g.has(Te)}if(Z){let Te=ce.texture.type,Pe=_.has(Te),Ee=O.getClearColor(),Ie=O.getClearAlpha(),ze=Ee.r,et=Ee.g,ft=Ee.b;Pe?(b[0]=ze,b[1]=et,b[2]=ft,b[3]=Ie,k.clearBufferuiv(k.COLOR,0,b)):(C[0]=ze,C[1]=et,C[2]=ft,C[3]=Ie,k.clearBufferiv(k.COLOR,0,C))}else Y|=k.COLOR_BUFFER_BIT}z&&(Y|=k.DEPTH_BUFFER_BIT,this.state.buffers.depth.setMask(!0)),j&&(Y|=k.STENCIL_BUFFER_BIT,this.state.buffers.stencil.setMask(4294967295)),Y!==0&&k.clear(Y)},this.clearColor=function(){this.clear(!0,!1,!1)},this.clearDepth=function(){this.clear(!1,!0,!1)},this.clearStencil=function(){this.clear(!1,!1,!0)},this.setNodesHandler=function(E){E.setRenderer(this),B=E},this.dispose=function(){t.removeEventListener("webglcontextlost",ke,!1),t.removeEventListener("webglcontextrestored",je,!1),t.removeEventListener("webglcontextcreationerror",Ce,!1),O.dispose(),ve.dispose(),te.dispose(),Ye.dispose(),Ve.dispose(),R.dispose(),ue.dispose(),q.dispose(),be.dispose(),He.dispose(),oe.dispose(),le.dispose(),le.removeEventListener("sessionstart",nl),le.removeEventListener("sessionend",Wi),cs.stop()};function ke(E){E.preventDefault(),ha("WebGLRenderer: Context Lost."),L=!0}function je(){ha("WebGLRenderer: Context Restored."),L=!1;let E=Ft.autoReset,z=pe.enabled,j=pe.autoUpdate,Y=pe.needsUpdate,Z=pe.type;Ke(),Ft.autoReset=E,pe.enabled=z,pe.autoUpdate=j,pe.needsUpdate=Y,pe.type=Z}function Ce(E){Qe("WebGLRenderer: A WebGL context could not be created. Reason: ",E.statusMessage)}function lt(E){let z=E.target;z.removeEventListener("dispose",lt),Ht(z)}function Ht(E){Xn(E),Ve.remove(E)}function Xn(E){let z=Ve.get(E).programs;z!==void 0&&(z.forEach(function(j){oe.releaseProgram(j)}),E.isShaderMaterial&&oe.releaseShaderCache(E))}this.renderBufferDirect=function(E,z,j,Y,Z,Te){z===null&&(z=vn);let Pe=Z.isMesh&&Z.matrixWorld.determinantAffine()<0,Ee=Bo(E,z,j,Y,Z);Me.setMaterial(Y,Pe);let Ie=j.index,ze=1;if(Y.wireframe===!0){if(Ie=q.getWireframeAttribute(j),Ie===void 0)return;ze=2}let et=j.drawRange,ft=j.attributes.position,Be=et.start*ze,pt=(et.start+et.count)*ze;Te!==null&&(Be=Math.max(Be,Te.start*ze),pt=Math.min(pt,(Te.start+Te.count)*ze)),Ie!==null?(Be=Math.max(Be,0),pt=Math.min(pt,Ie.count)):ft!=null&&(Be=Math.max(Be,0),pt=Math.min(pt,ft.count));let Qt=pt-Be;if(Qt<0||Qt===1/0)return;be.setup(Z,Y,Ee,j,Ie);let It,Lt=ne;if(Ie!==null&&(It=M.get(Ie),Lt=we,Lt.setIndex(It)),Z.isMesh)Y.wireframe===!0?(Me.setLineWidth(Y.wireframeLinewidth*hn()),Lt.setMode(k.LINES)):Lt.setMode(k.TRIANGLES);else if(Z.isLine){let yn=Y.linewidth;yn===void 0&&(yn=1),Me.setLineWidth(yn*hn()),Z.isLineSegments?Lt.setMode(k.LINES):Z.isLineLoop?Lt.setMode(k.LINE_LOOP):Lt.setMode(k.LINE_STRIP)}else Z.isPoints?Lt.setMode(k.POINTS):Z.isSprite&&Lt.setMode(k.TRIANGLES);if(Z.isBatchedMesh)if(Ze.get("WEBGL_multi_draw"))Lt.renderMultiDraw(Z._multiDrawStarts,Z._multiDrawCounts,Z._multiDrawCount);else{let yn=Z._multiDrawStarts,Ue=Z._multiDrawCounts,dn=Z._multiDrawCount,xt=Ie?M.get(Ie).bytesPerElement:1,hs=Ve.get(Y).currentProgram.getUniforms();for(let fn=0;fn<dn;fn++)hs.setValue(k,"_gl_DrawID",fn),Lt.render(yn[fn]/xt,Ue[fn])}else if(Z.isInstancedMesh)Lt.renderInstances(Be,Qt,Z.count);else if(j.isInstancedBufferGeometry){let yn=j._maxInstanceCount!==void 0?j._maxInstanceCount:1/0,Ue=Math.min(j.instanceCount,yn);Lt.renderInstances(Be,Qt,Ue)}else Lt.render(Be,Qt)};function Oo(E,z,j,Y){B!==null&&E.isNodeMaterial&&B.setObject(Y,E),Gt===!0&&ie.setState(E,j,!1),E.transparent===!0&&E.side===ns&&E.forceSinglePass===!1?(E.side=ti,E.needsUpdate=!0,Xi(E,z,Y),E.side=Qs,E.needsUpdate=!0,Xi(E,z,Y),E.side=ns):Xi(E,z,Y)}this.compile=function(E,z,j=null){j===null&&(j=E),B!==null&&B.renderStart(E,z,j),A=te.get(j),A.init(z),w.push(A),j.traverseVisible(function(Z){Z.isLight&&Z.layers.test(z.layers)&&(A.pushLight(Z),Z.castShadow&&A.pushShadow(Z))}),E!==j&&E.traverseVisible(function(Z){Z.isLight&&Z.layers.test(z.layers)&&(A.pushLight(Z),Z.castShadow&&A.pushShadow(Z))}),A.setupLights(),B!==null&&B.updateLights(A.state.lightsArray),un=this.localClippingEnabled,Gt=ie.init(this.clippingPlanes,un),Gt===!0&&ie.setGlobalState(this.clippingPlanes,z),B!==null&&pe.render(A.state.shadowsArray,j,z);let Y=new Set;return E.traverse(function(Z){if(!(Z.isMesh||Z.isPoints||Z.isLine||Z.isSprite))return;let Te=Z.material;if(Te)if(Array.isArray(Te))for(let Pe=0;Pe<Te.length;Pe++){let Ee=Te[Pe];Oo(Ee,j,z,Z),Y.add(Ee)}else Oo(Te,j,z,Z),Y.add(Te)}),A=w.pop(),B!==null&&B.renderEnd(),Y},this.compileAsync=function(E,z,j=null){let Y=this.compile(E,z,j);return new Promise(Z=>{function Te(){if(Y.forEach(function(Pe){let Ie=Ve.get(Pe).currentProgram;(Ie===void 0||Ie.isReady())&&Y.delete(Pe)}),Y.size===0){Z(E);return}setTimeout(Te,10)}Ze.get("KHR_parallel_shader_compile")!==null?Te():setTimeout(Te,10)})};let Tr=null;function nh(E){Tr&&Tr(E)}function nl(){cs.stop()}function Wi(){cs.start()}let cs=new Vg;cs.setAnimationLoop(nh),typeof self<"u"&&cs.setContext(self),this.setAnimationLoop=function(E){Tr=E,le.setAnimationLoop(E),E===null?cs.stop():cs.start()},le.addEventListener("sessionstart",nl),le.addEventListener("sessionend",Wi),this.render=function(E,z){if(z!==void 0&&z.isCamera!==!0){Qe("WebGLRenderer.render: camera is not an instance of THREE.Camera.");return}if(L===!0)return;B!==null&&B.renderStart(E,z);let j=le.enabled===!0&&le.isPresenting===!0,Y=F!==null&&(ce===null||j)&&F.begin(D,ce);if(E.matrixWorldAutoUpdate===!0&&E.updateMatrixWorld(),z.parent===null&&z.matrixWorldAutoUpdate===!0&&z.updateMatrixWorld(),le.enabled===!0&&le.isPresenting===!0&&(F===null||F.isCompositing()===!1)&&(le.cameraAutoUpdate===!0&&le.updateCamera(z),z=le.getCamera()),E.isScene===!0&&E.onBeforeRender(D,E,z,ce),A=te.get(E,w.length),A.init(z),A.state.textureUnits=Ye.getTextureUnits(),w.push(A),Ut.multiplyMatrices(z.projectionMatrix,z.matrixWorldInverse),z.isArrayCamera?Zt.setFromArrayCamera(z):it.setFromProjectionMatrix(Ut,Mi,z.reversedDepth),un=this.localClippingEnabled,Gt=ie.init(this.clippingPlanes,un),P=ve.get(E,x.length),P.init(),x.push(P),this.info.render.frame++,le.enabled===!0&&le.isPresenting===!0){let Pe=D.xr.getDepthSensingMesh();Pe!==null&&us(Pe,z,-1/0,D.sortObjects)}us(E,z,0,D.sortObjects),P.finish(),B!==null&&B.updateLights(A.state.lightsArray),D.sortObjects===!0&&P.sort(We,ot),tn=le.enabled===!1||le.isPresenting===!1||le.hasDepthSensing()===!1,tn&&O.addToRenderList(P,E),this.info.autoReset===!0&&this.info.reset(),Gt===!0&&ie.beginShadows();let Z=A.state.shadowsArray;if(pe.render(Z,E,z),Gt===!0&&ie.endShadows(),(Y&&F.hasRenderPass())===!1){let Pe=P.opaque,Ee=P.transmissive;if(A.setupLights(),z.isArrayCamera){let Ie=z.cameras;if(Ee.length>0)for(let ze=0,et=Ie.length;ze<et;ze++){let ft=Ie[ze];Ai(Pe,Ee,E,ft)}tn&&O.render(E);for(let ze=0,et=Ie.length;ze<et;ze++){let ft=Ie[ze];Fo(P,E,ft,ft.viewport)}}else Ee.length>0&&Ai(Pe,Ee,E,z),tn&&O.render(E),Fo(P,E,z)}ce!==null&&W===0&&(Ye.updateMultisampleRenderTarget(ce),Ye.updateRenderTargetMipmap(ce)),Y&&F.end(D),E.isScene===!0&&E.onAfterRender(D,E,z),be.resetDefaultState(),K=-1,Q=null,w.pop(),w.length>0?(A=w[w.length-1],Ye.setTextureUnits(A.state.textureUnits),Gt===!0&&ie.setGlobalState(D.clippingPlanes,A.state.camera)):A=null,x.pop(),x.length>0?P=x[x.length-1]:P=null,B!==null&&B.renderEnd()};function us(E,z,j,Y){if(E.visible===!1)return;if(E.layers.test(z.layers)){if(E.isGroup)j=E.renderOrder;else if(E.isLOD)E.autoUpdate===!0&&E.update(z);else if(E.isLight)A.pushLight(E),E.castShadow&&A.pushShadow(E);else if(E.isSprite){let Pe=z.isArrayCamera?Zt:it;if(!E.frustumCulled||E.intersectsFrustum(Pe)){Y&&St.setFromMatrixPosition(E.matrixWorld).applyMatrix4(Ut);let Ee=ue.update(E),Ie=E.material;Ie.visible&&P.push(E,Ee,Ie,j,St.z,null,z)}}else if(E.isMesh||E.isLine||E.isPoints){let Pe=z.isArrayCamera?Zt:it;if(!E.frustumCulled||E.intersectsFrustum(Pe)){let Ee=ue.update(E),Ie=E.material;if(Y&&(E.boundingSphere!==void 0?(E.boundingSphere===null&&E.computeBoundingSphere(),St.copy(E.boundingSphere.center)):(Ee.boundingSphere===null&&Ee.computeBoundingSphere(),St.copy(Ee.boundingSphere.center)),St.applyMatrix4(E.matrixWorld).applyMatrix4(Ut)),Array.isArray(Ie)){let ze=Ee.groups;for(let et=0,ft=ze.length;et<ft;et++){let Be=ze[et],pt=Ie[Be.materialIndex];pt&&pt.visible&&P.push(E,Ee,pt,j,St.z,Be,z)}}else Ie.visible&&P.push(E,Ee,Ie,j,St.z,null,z)}}}let Te=E.children;for(let Pe=0,Ee=Te.length;Pe<Ee;Pe++)us(Te[Pe],z,j,Y)}function Fo(E,z,j,Y){let{opaque:Z,transmissive:Te,transparent:Pe}=E;A.setupLightsView(j),Gt===!0&&ie.setGlobalState(D.clippingPlanes,j),Y&&Me.viewport(se.copy(Y)),Z.length>0&&nn(Z,z,j),Te.length>0&&nn(Te,z,j),Pe.length>0&&nn(Pe,z,j),Me.buffers.depth.setTest(!0),Me.buffers.depth.setMask(!0),Me.buffers.color.setMask(!0),Me.setPolygonOffset(!1)}function Ai(E,z,j,Y){if((j.isScene===!0?j.overrideMaterial:null)!==null)return;if(A.state.transmissionRenderTarget[Y.id]===void 0){let Be=Ze.has("EXT_color_buffer_half_float")||Ze.has("EXT_color_buffer_float");A.state.transmissionRenderTarget[Y.id]=new mi(1,1,{generateMipmaps:!0,type:Be?Bi:oi,minFilter:Es,samples:Math.max(4,at.samples),stencilBuffer:r,resolveDepthBuffer:!1,resolveStencilBuffer:!1,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,colorSpace:yt.workingColorSpace})}let Te=A.state.transmissionRenderTarget[Y.id],Pe=Y.viewport||se;Te.setSize(Pe.z*D.transmissionResolutionScale,Pe.w*D.transmissionResolutionScale);let Ee=D.getRenderTarget(),Ie=D.getActiveCubeFace(),ze=D.getActiveMipmapLevel();D.setRenderTarget(Te),D.getClearColor(ee),me=D.getClearAlpha(),me<1&&D.setClearColor(16777215,.5),D.clear(),tn&&O.render(j);let et=D.toneMapping;D.toneMapping=is;let ft=Y.viewport;if(Y.viewport!==void 0&&(Y.viewport=void 0),A.setupLightsView(Y),Gt===!0&&ie.setGlobalState(D.clippingPlanes,Y),nn(E,j,Y),Ye.updateMultisampleRenderTarget(Te),Ye.updateRenderTargetMipmap(Te),Ze.has("WEBGL_multisampled_render_to_texture")===!1){let Be=!1;for(let pt=0,Qt=z.length;pt<Qt;pt++){let It=z[pt],{object:Lt,geometry:yn,material:Ue,group:dn}=It;if(Ue.side===ns&&Lt.layers.test(Y.layers)){let xt=Ue.side;Ue.side=ti,Ue.needsUpdate=!0,an(Lt,j,Y,yn,Ue,dn),Ue.side=xt,Ue.needsUpdate=!0,Be=!0}}Be===!0&&(Ye.updateMultisampleRenderTarget(Te),Ye.updateRenderTargetMipmap(Te))}D.setRenderTarget(Ee,Ie,ze),D.setClearColor(ee,me),ft!==void 0&&(Y.viewport=ft),D.toneMapping=et}function nn(E,z,j){let Y=z.isScene===!0?z.overrideMaterial:null;for(let Z=0,Te=E.length;Z<Te;Z++){let Pe=E[Z],{object:Ee,geometry:Ie,group:ze}=Pe,et=Pe.material;et.allowOverride===!0&&Y!==null&&(et=Y),Ee.layers.test(j.layers)&&an(Ee,z,j,Ie,et,ze)}}function an(E,z,j,Y,Z,Te){B!==null&&Z.isNodeMaterial&&B.setObject(E,Z),E.onBeforeRender(D,z,j,Y,Z,Te),E.modelViewMatrix.multiplyMatrices(j.matrixWorldInverse,E.matrixWorld),E.normalMatrix.getNormalMatrix(E.modelViewMatrix),Z.onBeforeRender(D,z,j,Y,E,Te),Z.transparent===!0&&Z.side===ns&&Z.forceSinglePass===!1?(Z.side=ti,Z.needsUpdate=!0,D.renderBufferDirect(j,z,Y,Z,E,Te),Z.side=Qs,Z.needsUpdate=!0,D.renderBufferDirect(j,z,Y,Z,E,Te),Z.side=ns):D.renderBufferDirect(j,z,Y,Z,E,Te),E.onAfterRender(D,z,j,Y,Z,Te)}function ln(E){let z=0;for(let j of E)j.texture!==null&&z++;return z}function Xi(E,z,j){z.isScene!==!0&&(z=vn);let Y=Ve.get(E),Z=A.state.lights,Te=A.state.shadowsArray,Pe=Z.state.version,Ee=oe.getParameters(E,Z.state,Te,z,j,A.state.lightProbeGridArray),Ie=oe.getProgramCacheKey(Ee),ze=Y.programs;Y.environment=E.isMeshStandardMaterial||E.isMeshLambertMaterial||E.isMeshPhongMaterial?z.environment:null,Y.fog=z.fog;let et=E.isMeshStandardMaterial||E.isMeshLambertMaterial&&!E.envMap||E.isMeshPhongMaterial&&!E.envMap;Y.envMap=R.get(E.envMap||Y.environment,et),Y.envMapRotation=Y.environment!==null&&E.envMap===null?z.environmentRotation:E.envMapRotation,ze===void 0&&(E.addEventListener("dispose",lt),ze=new Map,Y.programs=ze,Y.programVariants=new Map);let ft=ze.get(Ie);if(ft!==void 0){if(Y.currentProgram===ft&&Y.lightsStateVersion===Pe)return ko(E,Ee),ft}else Ee.uniforms=oe.getUniforms(E),B!==null&&E.isNodeMaterial&&B.build(E,j,Ee),E.onBeforeCompile(Ee,D),ft=oe.acquireProgram(Ee,Ie),ze.set(Ie,ft),Y.uniforms=Ee.uniforms;let Be=Y.uniforms;return(!E.isShaderMaterial&&!E.isRawShaderMaterial||E.clipping===!0)&&(Be.clippingPlanes=ie.uniform),ko(E,Ee),Y.needsLights=Ds(E),Y.lightsStateVersion=Pe,Y.needsLights&&(Be.ambientLightColor.value=Z.state.ambient,Be.lightProbe.value=Z.state.probe,Be.sunLights.value=Z.state.sun,Be.sunLightShadows.value=Z.state.sunShadow,Be.directionalLights.value=Z.state.directional,Be.directionalLightShadows.value=Z.state.directionalShadow,Be.spotLights.value=Z.state.spot,Be.spotLightShadows.value=Z.state.spotShadow,Be.rectAreaLights.value=Z.state.rectArea,Be.ltc_1.value=Z.state.rectAreaLTC1,Be.ltc_2.value=Z.state.rectAreaLTC2,Be.pointLights.value=Z.state.point,Be.pointLightShadows.value=Z.state.pointShadow,Be.hemisphereLights.value=Z.state.hemi,Be.sunShadowMatrix.value=Z.state.sunShadowMatrix,Be.sunShadowCascade.value=Z.state.sunShadowCascade,Be.directionalShadowMatrix.value=Z.state.directionalShadowMatrix,Be.spotLightMatrix.value=Z.state.spotLightMatrix,Be.spotLightMap.value=Z.state.spotLightMap,Be.pointShadowMatrix.value=Z.state.pointShadowMatrix),Y.numLightProbeGrids=ln(A.state.lightProbeGridArray),Y.currentProgram=ft,Y.uniformsList=null,ft}function li(E,z,j,Y,Z){let Te=Ve.get(E),Pe=Te.currentProgram.id+","+Y+","+Z,Ee=Te.programVariants.get(Pe);return Ee===void 0?(Ee=Xi(E,z,j),Te.programVariants.set(Pe,Ee)):(Te.currentProgram=Ee,Te.uniformsList=null,Te.outputColorSpace=Y,Te.toneMapping=Z),Ee}function Ls(E){if(E.uniformsList===null){let z=E.currentProgram.getUniforms();E.uniformsList=bo.seqWithValue(z.seq,E.uniforms)}return E.uniformsList}function ko(E,z){let j=Ve.get(E);j.outputColorSpace=z.outputColorSpace,j.batching=z.batching,j.batchingColor=z.batchingColor,j.instancing=z.instancing,j.instancingColor=z.instancingColor,j.instancingMorph=z.instancingMorph,j.skinning=z.skinning,j.morphTargets=z.morphTargets,j.morphNormals=z.morphNormals,j.morphColors=z.morphColors,j.morphTargetsCount=z.morphTargetsCount,j.numClippingPlanes=z.numClippingPlanes,j.numIntersection=z.numClipIntersection,j.vertexAlphas=z.vertexAlphas,j.vertexTangents=z.vertexTangents,j.toneMapping=z.toneMapping}function Bo(E,z,j,Y,Z){z.isScene!==!0&&(z=vn),Ye.resetTextureUnits();let Te=z.fog,Pe=Y.isMeshStandardMaterial||Y.isMeshLambertMaterial||Y.isMeshPhongMaterial?z.environment:null,Ee=ce===null?D.outputColorSpace:ce.isXRRenderTarget===!0?ce.texture.colorSpace:yt.workingColorSpace,Ie=Y.isMeshStandardMaterial||Y.isMeshLambertMaterial&&!Y.envMap||Y.isMeshPhongMaterial&&!Y.envMap,ze=R.get(Y.envMap||Pe,Ie),et=Y.vertexColors===!0&&!!j.attributes.color&&j.attributes.color.itemSize===4,ft=!!j.attributes.tangent&&(!!Y.normalMap||Y.anisotropy>0),Be=!!j.morphAttributes.position,pt=!!j.morphAttributes.normal,Qt=!!j.morphAttributes.color,It=is;Y.toneMapped&&(ce===null||ce.isXRRenderTarget===!0)&&(It=D.toneMapping);let Lt=j.morphAttributes.position||j.morphAttributes.normal||j.morphAttributes.color,yn=Lt!==void 0?Lt.length:0,Ue=Ve.get(Y),dn=A.state.lights;if(Gt===!0&&(un===!0||E!==Q)){let Dt=E===Q&&Y.id===K;ie.setState(Y,E,Dt)}let xt=!1,hs=!1;Y.version===Ue.__version?Ue.needsLights&&Ue.lightsStateVersion!==dn.state.version||Z.isBatchedMesh&&Ue.batching===!1||!Z.isBatchedMesh&&Ue.batching===!0||Z.isBatchedMesh&&Ue.batchingColor===!0&&Z._colorsTexture===null||Z.isBatchedMesh&&Ue.batchingColor===!1&&Z._colorsTexture!==null||Z.isInstancedMesh&&Ue.instancing===!1||!Z.isInstancedMesh&&Ue.instancing===!0||Z.isSkinnedMesh&&Ue.skinning===!1||!Z.isSkinnedMesh&&Ue.skinning===!0||Z.isInstancedMesh&&Ue.instancingColor===!0&&Z.instanceColor===null||Z.isInstancedMesh&&Ue.instancingColor===!1&&Z.instanceColor!==null||Z.isInstancedMesh&&Ue.instancingMorph===!0&&Z.morphTexture===null||Z.isInstancedMesh&&Ue.instancingMorph===!1&&Z.morphTexture!==null||Ue.envMap!==ze||Y.fog===!0&&Ue.fog!==Te||Ue.numClippingPlanes!==void 0&&(Ue.numClippingPlanes!==ie.numPlanes||Ue.numIntersection!==ie.numIntersection)||Ue.vertexAlphas!==et||Ue.vertexTangents!==ft||Ue.morphTargets!==Be||Ue.morphNormals!==pt||Ue.morphColors!==Qt||Ue.morphTargetsCount!==yn||Ue.numLightProbeGrids!==ln(A.state.lightProbeGridArray)?xt=!0:(Ue.outputColorSpace!==Ee||Ue.toneMapping!==It)&&(hs=!0):(xt=!0,Ue.__version=Y.version);let fn=Ue.currentProgram;(xt===!0||hs===!0)&&(fn=hs===!0?li(Y,z,Z,Ee,It):Xi(Y,z,Z),B&&Y.isNodeMaterial&&B.onUpdateProgram(Y,fn,Ue));let Cr=!1,qi=!1,ds=!1,ut=fn.getUniforms(),sn=Ue.uniforms;if(Me.useProgram(fn.program)&&(Cr=!0,qi=!0,ds=!0),Y.id!==K&&(K=Y.id,qi=!0),Cr||Q!==E){Me.buffers.depth.getReversed()&&E.reversedDepth!==!0&&(E._reversedDepth=!0,E.updateProjectionMatrix()),ut.setValue(k,"projectionMatrix",E.projectionMatrix),ut.setValue(k,"viewMatrix",E.matrixWorldInverse);let pn=ut.map.cameraPosition;pn!==void 0&&pn.setValue(k,Cn.setFromMatrixPosition(E.matrixWorld)),at.logarithmicDepthBuffer&&ut.setValue(k,"logDepthBufFC",2/(Math.log(E.far+1)/Math.LN2)),(Y.isMeshPhongMaterial||Y.isMeshToonMaterial||Y.isMeshLambertMaterial||Y.isMeshBasicMaterial||Y.isMeshStandardMaterial||Y.isShaderMaterial)&&ut.setValue(k,"isOrthographic",E.isOrthographicCamera===!0),Q!==E&&(Q=E,qi=!0,ds=!0)}if(Ue.needsLights&&(dn.state.sunShadowMap.length>0&&ut.setValue(k,"sunShadowMap",dn.state.sunShadowMap,Ye),dn.state.directionalShadowMap.length>0&&ut.setValue(k,"directionalShadowMap",dn.state.directionalShadowMap,Ye),dn.state.spotShadowMap.length>0&&ut.setValue(k,"spotShadowMap",dn.state.spotShadowMap,Ye),dn.state.pointShadowMap.length>0&&ut.setValue(k,"pointShadowMap",dn.state.pointShadowMap,Ye)),Z.isSkinnedMesh){ut.setOptional(k,Z,"bindMatrix"),ut.setOptional(k,Z,"bindMatrixInverse");let Dt=Z.skeleton;Dt&&(Dt.boneTexture===null&&Dt.computeBoneTexture(),ut.setValue(k,"boneTexture",Dt.boneTexture,Ye))}Z.isBatchedMesh&&(ut.setOptional(k,Z,"batchingTexture"),ut.setValue(k,"batchingTexture",Z._matricesTexture,Ye),ut.setOptional(k,Z,"batchingIdTexture"),ut.setValue(k,"batchingIdTexture",Z._indirectTexture,Ye),ut.setOptional(k,Z,"batchingColorTexture"),Z._colorsTexture!==null&&ut.setValue(k,"batchingColorTexture",Z._colorsTexture,Ye));let qn=j.morphAttributes;if((qn.position!==void 0||qn.normal!==void 0||qn.color!==void 0)&&re.update(Z,j,fn),(qi||Ue.receiveShadow!==Z.receiveShadow)&&(Ue.receiveShadow=Z.receiveShadow,ut.setValue(k,"receiveShadow",Z.receiveShadow)),(Y.isMeshStandardMaterial||Y.isMeshLambertMaterial||Y.isMeshPhongMaterial)&&Y.envMap===null&&z.environment!==null&&(sn.envMapIntensity.value=z.environmentIntensity),sn.dfgLUT!==void 0&&(sn.dfgLUT.value=Dw()),qi){if(ut.setValue(k,"toneMappingExposure",D.toneMappingExposure),Ue.needsLights&&Er(sn,ds),Te&&Y.fog===!0&&_e.refreshFogUniforms(sn,Te),_e.refreshMaterialUniforms(sn,Y,Se,Ae,A.state.transmissionRenderTarget[E.id]),Ue.needsLights&&Ue.numLightProbeGrids>0){let Dt=S,pn=0;for(let zn of A.state.lightProbeGridArray)zn.texture!==null&&(Dt.textures[pn]=zn.texture,Dt.min[pn]=zn.boundingBox.min,Dt.max[pn]=zn.boundingBox.max,Dt.resolution[pn]=zn.resolution,pn++);for(let zn in Dt)Dt[zn].length=pn;sn.probesSH.value=Dt.textures,sn.probesMin.value=Dt.min,sn.probesMax.value=Dt.max,sn.probesResolution.value=Dt.resolution}bo.upload(k,Ls(Ue),sn,Ye)}if(Y.isShaderMaterial&&Y.uniformsNeedUpdate===!0&&(bo.upload(k,Ls(Ue),sn,Ye),Y.uniformsNeedUpdate=!1),Y.isSpriteMaterial&&ut.setValue(k,"center",Z.center),ut.setValue(k,"modelViewMatrix",Z.modelViewMatrix),ut.setValue(k,"normalMatrix",Z.normalMatrix),ut.setValue(k,"modelMatrix",Z.matrixWorld),Y.uniformsGroups!==void 0){let Dt=Y.uniformsGroups;for(let pn=0,zn=Dt.length;pn<zn;pn++){let il=Dt[pn];He.update(il,fn),He.bind(il,fn)}}return fn}function Er(E,z){E.ambientLightColor.needsUpdate=z,E.lightProbe.needsUpdate=z,E.sunLights.needsUpdate=z,E.sunLightShadows.needsUpdate=z,E.directionalLights.needsUpdate=z,E.directionalLightShadows.needsUpdate=z,E.pointLights.needsUpdate=z,E.pointLightShadows.needsUpdate=z,E.spotLights.needsUpdate=z,E.spotLightShadows.needsUpdate=z,E.rectAreaLights.needsUpdate=z,E.hemisphereLights.needsUpdate=z}function Ds(E){return E.isMeshLambertMaterial||E.isMeshToonMaterial||E.isMeshPhongMaterial||E.isMeshStandardMaterial||E.isShadowMaterial||E.isShaderMaterial&&E.lights===!0}this.getActiveCubeFace=function(){return $},this.getActiveMipmapLevel=function(){return W},this.getRenderTarget=function(){return ce},this.setRenderTargetTextures=function(E,z,j){let Y=Ve.get(E);Y.__autoAllocateDepthBuffer=E.resolveDepthBuffer===!1,Y.__autoAllocateDepthBuffer===!1&&(Y.__useRenderToTexture=!1),Ve.get(E.texture).__webglTexture=z,Ve.get(E.depthTexture).__webglTexture=Y.__autoAllocateDepthBuffer?void 0:j,Y.__hasExternalTextures=!0},this.setRenderTargetFramebuffer=function(E,z){let j=Ve.get(E);j.__webglFramebuffer=z,j.__useDefaultFramebuffer=z===void 0},this.setRenderTarget=function(E,z=0,j=0){ce=E,$=z,W=j;let Y=null,Z=!1,Te=!1;if(E){let Ee=Ve.get(E);if(Ee.__useDefaultFramebuffer!==void 0){Me.bindFramebuffer(k.FRAMEBUFFER,Ee.__webglFramebuffer),se.copy(E.viewport),de.copy(E.scissor),he=E.scissorTest,Me.viewport(se),Me.scissor(de),Me.setScissorTest(he),K=-1;return}else if(Ee.__webglFramebuffer===void 0)Ye.setupRenderTarget(E);else if(Ee.__hasExternalTextures)Ye.rebindTextures(E,Ve.get(E.texture).__webglTexture,Ve.get(E.depthTexture).__webglTexture);else if(E.depthBuffer){let et=E.depthTexture;if(Ee.__boundDepthTexture!==et){if(et!==null&&Ve.has(et)&&(E.width!==et.image.width||E.height!==et.image.height))throw new Error("THREE.WebGLRenderer: Attached DepthTexture is initialized to the incorrect size.");Ye.setupDepthRenderbuffer(E)}}let Ie=E.texture;(Ie.isData3DTexture||Ie.isDataArrayTexture||Ie.isCompressedArrayTexture)&&(Te=!0);let ze=Ve.get(E).__webglFramebuffer;E.isWebGLCubeRenderTarget?(Array.isArray(ze[z])?Y=ze[z][j]:Y=ze[z],Z=!0):E.samples>0&&Ye.useMultisampledRTT(E)===!1?Y=Ve.get(E).__webglMultisampledFramebuffer:Array.isArray(ze)?Y=ze[j]:Y=ze,se.copy(E.viewport),de.copy(E.scissor),he=E.scissorTest}else se.copy(Ge).multiplyScalar(Se).floor(),de.copy(dt).multiplyScalar(Se).floor(),he=ct;if(j!==0&&(Y=V),Me.bindFramebuffer(k.FRAMEBUFFER,Y)&&Me.drawBuffers(E,Y),Me.viewport(se),Me.scissor(de),Me.setScissorTest(he),Z){let Ee=Ve.get(E.texture);k.framebufferTexture2D(k.FRAMEBUFFER,k.COLOR_ATTACHMENT0,k.TEXTURE_CUBE_MAP_POSITIVE_X+z,Ee.__webglTexture,j)}else if(Te){let Ee=z;for(let Ie=0;Ie<E.textures.length;Ie++){let ze=Ve.get(E.textures[Ie]);k.framebufferTextureLayer(k.FRAMEBUFFER,k.COLOR_ATTACHMENT0+Ie,ze.__webglTexture,j,Ee)}}else if(E!==null&&j!==0){let Ee=Ve.get(E.texture);k.framebufferTexture2D(k.FRAMEBUFFER,k.COLOR_ATTACHMENT0,k.TEXTURE_2D,Ee.__webglTexture,j)}K=-1};function Ar(E){let z=Ve.get(E);return(z.__readFormat!==E.format||z.__readType!==E.type)&&(z.__readFormat=E.format,z.__readType=E.type,z.__formatReadable=at.textureFormatReadable(E.format),z.__typeReadable=at.textureTypeReadable(E.type)),z}this.readRenderTargetPixels=function(E,z,j,Y,Z,Te,Pe,Ee=0){if(!(E&&E.isWebGLRenderTarget)){Qe("WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");return}let Ie=Ve.get(E).__webglFramebuffer;if(E.isWebGLCubeRenderTarget&&Pe!==void 0&&(Ie=Ie[Pe],Array.isArray(Ie)&&(Ie=Ie[0])),Ie){Me.bindFramebuffer(k.FRAMEBUFFER,Ie);try{let ze=E.textures[Ee],et=ze.format,ft=ze.type;E.textures.length>1&&k.readBuffer(k.COLOR_ATTACHMENT0+Ee);let Be=Ar(ze);if(Be.__formatReadable===!1){Qe("WebGLRenderer.readRenderTargetPixels: renderTarget is not in RGBA or implementation defined format.");return}if(Be.__typeReadable===!1){Qe("WebGLRenderer.readRenderTargetPixels: renderTarget is not in UnsignedByteType or implementation defined type.");return}z>=0&&z<=E.width-Y&&j>=0&&j<=E.height-Z&&k.readPixels(z,j,Y,Z,ge.convert(et),ge.convert(ft),Te)}finally{let ze=ce!==null?Ve.get(ce).__webglFramebuffer:null;Me.bindFramebuffer(k.FRAMEBUFFER,ze)}}},this.readRenderTargetPixelsAsync=async function(E,z,j,Y,Z,Te,Pe,Ee=0){if(!(E&&E.isWebGLRenderTarget))throw new Error("THREE.WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");let Ie=Ve.get(E).__webglFramebuffer;if(E.isWebGLCubeRenderTarget&&Pe!==void 0&&(Ie=Ie[Pe],Array.isArray(Ie)&&(Ie=Ie[0])),Ie)if(z>=0&&z<=E.width-Y&&j>=0&&j<=E.height-Z){Me.bindFramebuffer(k.FRAMEBUFFER,Ie);let ze=E.textures[Ee],et=ze.format,ft=ze.type;E.textures.length>1&&k.readBuffer(k.COLOR_ATTACHMENT0+Ee);let Be=Ar(ze);if(Be.__formatReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in RGBA or implementation defined format.");if(Be.__typeReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in UnsignedByteType or implementation defined type.");let pt=k.createBuffer();k.bindBuffer(k.PIXEL_PACK_BUFFER,pt),k.bufferData(k.PIXEL_PACK_BUFFER,Te.byteLength,k.STREAM_READ),k.readPixels(z,j,Y,Z,ge.convert(et),ge.convert(ft),0),k.bindBuffer(k.PIXEL_PACK_BUFFER,null);let Qt=ce!==null?Ve.get(ce).__webglFramebuffer:null;Me.bindFramebuffer(k.FRAMEBUFFER,Qt);let It=k.fenceSync(k.SYNC_GPU_COMMANDS_COMPLETE,0);return k.flush(),await fg(k,It,4),k.bindBuffer(k.PIXEL_PACK_BUFFER,pt),k.getBufferSubData(k.PIXEL_PACK_BUFFER,0,Te),k.bindBuffer(k.PIXEL_PACK_BUFFER,null),k.deleteBuffer(pt),k.deleteSync(It),Te}else throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: requested read bounds are out of range.")},this.copyFramebufferToTexture=function(E,z=null,j=0){let Y=Math.pow(2,-j),Z=Math.floor(E.image.width*Y),Te=Math.floor(E.image.height*Y),Pe=z!==null?z.x:0,Ee=z!==null?z.y:0;Ye.setTexture2D(E,0),k.copyTexSubImage2D(k.TEXTURE_2D,j,0,0,Pe,Ee,Z,Te),Me.unbindTexture()},this.copyTextureToTexture=function(E,z,j=null,Y=null,Z=0,Te=0){let Pe,Ee,Ie,ze,et,ft,Be,pt,Qt,It=E.isCompressedTexture?E.mipmaps[Te]:E.image;if(j!==null)Pe=j.max.x-j.min.x,Ee=j.max.y-j.min.y,Ie=j.isBox3?j.max.z-j.min.z:1,ze=j.min.x,et=j.min.y,ft=j.isBox3?j.min.z:0;else{let ut=Math.pow(2,-Z);Pe=Math.floor(It.width*ut),Ee=Math.floor(It.height*ut),E.isDataArrayTexture?Ie=It.depth:E.isData3DTexture?Ie=Math.floor(It.depth*ut):Ie=1,ze=0,et=0,ft=0}Y!==null?(Be=Y.x,pt=Y.y,Qt=Y.z):(Be=0,pt=0,Qt=0);let Lt=ge.convert(z.format),yn=ge.convert(z.type),Ue;z.isData3DTexture?(Ye.setTexture3D(z,0),Ue=k.TEXTURE_3D):z.isDataArrayTexture||z.isCompressedArrayTexture?(Ye.setTexture2DArray(z,0),Ue=k.TEXTURE_2D_ARRAY):(Ye.setTexture2D(z,0),Ue=k.TEXTURE_2D),Me.activeTexture(k.TEXTURE0),Me.pixelStorei(k.UNPACK_FLIP_Y_WEBGL,z.flipY),Me.pixelStorei(k.UNPACK_PREMULTIPLY_ALPHA_WEBGL,z.premultiplyAlpha),Me.pixelStorei(k.UNPACK_ALIGNMENT,z.unpackAlignment);let dn=Me.getParameter(k.UNPACK_ROW_LENGTH),xt=Me.getParameter(k.UNPACK_IMAGE_HEIGHT),hs=Me.getParameter(k.UNPACK_SKIP_PIXELS),fn=Me.getParameter(k.UNPACK_SKIP_ROWS),Cr=Me.getParameter(k.UNPACK_SKIP_IMAGES);Me.pixelStorei(k.UNPACK_ROW_LENGTH,It.width),Me.pixelStorei(k.UNPACK_IMAGE_HEIGHT,It.height),Me.pixelStorei(k.UNPACK_SKIP_PIXELS,ze),Me.pixelStorei(k.UNPACK_SKIP_ROWS,et),Me.pixelStorei(k.UNPACK_SKIP_IMAGES,ft);let qi=E.isDataArrayTexture||E.isData3DTexture,ds=z.isDataArrayTexture||z.isData3DTexture;if(E.isDepthTexture){let ut=Ve.get(E),sn=Ve.get(z),qn=Ve.get(ut.__renderTarget),Dt=Ve.get(sn.__renderTarget);Me.bindFramebuffer(k.READ_FRAMEBUFFER,qn.__webglFramebuffer),Me.bindFramebuffer(k.DRAW_FRAMEBUFFER,Dt.__webglFramebuffer);for(let pn=0;pn<Ie;pn++)qi&&(k.framebufferTextureLayer(k.READ_FRAMEBUFFER,k.COLOR_ATTACHMENT0,Ve.get(E).__webglTexture,Z,ft+pn),k.framebufferTextureLayer(k.DRAW_FRAMEBUFFER,k.COLOR_ATTACHMENT0,Ve.get(z).__webglTexture,Te,Qt+pn)),k.blitFramebuffer(ze,et,ze+Pe,et+Ee,Be,pt,Be+Pe,pt+Ee,k.DEPTH_BUFFER_BIT,k.NEAREST);Me.bindFramebuffer(k.READ_FRAMEBUFFER,null),Me.bindFramebuffer(k.DRAW_FRAMEBUFFER,null)}else if(Z!==0||E.isRenderTargetTexture||Ve.has(E)){let ut=Ve.get(E),sn=Ve.get(z);Me.bindFramebuffer(k.READ_FRAMEBUFFER,U),Me.bindFramebuffer(k.DRAW_FRAMEBUFFER,X);for(let qn=0;qn<Ie;qn++)qi?k.framebufferTextureLayer(k.READ_FRAMEBUFFER,k.COLOR_ATTACHMENT0,ut.__webglTexture,Z,ft+qn):k.framebufferTexture2D(k.READ_FRAMEBUFFER,k.COLOR_ATTACHMENT0,k.TEXTURE_2D,ut.__webglTexture,Z),ds?k.framebufferTextureLayer(k.DRAW_FRAMEBUFFER,k.COLOR_ATTACHMENT0,sn.__webglTexture,Te,Qt+qn):k.framebufferTexture2D(k.DRAW_FRAMEBUFFER,k.COLOR_ATTACHMENT0,k.TEXTURE_2D,sn.__webglTexture,Te),Z!==0?k.blitFramebuffer(ze,et,ze+Pe,et+Ee,Be,pt,Be+Pe,pt+Ee,k.COLOR_BUFFER_BIT,k.NEAREST):ds?k.copyTexSubImage3D(Ue,Te,Be,pt,Qt+qn,ze,et,Pe,Ee):k.copyTexSubImage2D(Ue,Te,Be,pt,ze,et,Pe,Ee);Me.bindFramebuffer(k.READ_FRAMEBUFFER,null),Me.bindFramebuffer(k.DRAW_FRAMEBUFFER,null)}else ds?E.isDataTexture||E.isData3DTexture?k.texSubImage3D(Ue,Te,Be,pt,Qt,Pe,Ee,Ie,Lt,yn,It.data):z.isCompressedArrayTexture?k.compressedTexSubImage3D(Ue,Te,Be,pt,Qt,Pe,Ee,Ie,Lt,It.data):k.texSubImage3D(Ue,Te,Be,pt,Qt,Pe,Ee,Ie,Lt,yn,It):E.isDataTexture?k.texSubImage2D(k.TEXTURE_2D,Te,Be,pt,Pe,Ee,Lt,yn,It.data):E.isCompressedTexture?k.compressedTexSubImage2D(k.TEXTURE_2D,Te,Be,pt,It.width,It.height,Lt,It.data):k.texSubImage2D(k.TEXTURE_2D,Te,Be,pt,Pe,Ee,Lt,yn,It);Me.pixelStorei(k.UNPACK_ROW_LENGTH,dn),Me.pixelStorei(k.UNPACK_IMAGE_HEIGHT,xt),Me.pixelStorei(k.UNPACK_SKIP_PIXELS,hs),Me.pixelStorei(k.UNPACK_SKIP_ROWS,fn),Me.pixelStorei(k.UNPACK_SKIP_IMAGES,Cr),Te===0&&z.generateMipmaps===!0&&z.mipmapsAutoUpdate===!0&&k.generateMipmap(Ue),Me.unbindTexture()},this.initRenderTarget=function(E){Ve.get(E).__webglFramebuffer===void 0&&Ye.setupRenderTarget(E)},this.initTexture=function(E){E.isCubeTexture?Ye.setTextureCube(E,0):E.isData3DTexture?Ye.setTexture3D(E,0):E.isDataArrayTexture||E.isCompressedArrayTexture?Ye.setTexture2DArray(E,0):Ye.setTexture2D(E,0),Me.unbindTexture()},this.resetState=function(){$=0,W=0,ce=null,Me.reset(),be.reset()},typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}get coordinateSystem(){return Mi}get outputColorSpace(){return this._outputColorSpace}set outputColorSpace(e){this._outputColorSpace=e;let t=this.getContext();t.drawingBufferColorSpace=yt._getDrawingBufferColorSpace(e),t.unpackColorSpace=yt._getUnpackColorSpace()}};var jg={type:"change"},rf={type:"start"},e_={type:"end"},wu=new qs,Qg=new pi,Nw=Math.cos(70*Gd.DEG2RAD),Tn=new H,ai=2*Math.PI,At={NONE:-1,ROTATE:0,DOLLY:1,PAN:2,TOUCH_ROTATE:3,TOUCH_PAN:4,TOUCH_DOLLY_PAN:5,TOUCH_DOLLY_ROTATE:6},sf=1e-6,Tu=class extends Ua{constructor(e,t=null){super(e,t),this.state=At.NONE,this.target=new H,this.cursor=new H,this.minDistance=0,this.maxDistance=1/0,this.minZoom=0,this.maxZoom=1/0,this.minTargetRadius=0,this.maxTargetRadius=1/0,this.minPolarAngle=0,this.maxPolarAngle=Math.PI,this.minAzimuthAngle=-1/0,this.maxAzimuthAngle=1/0,this.enableDamping=!1,this.dampingFactor=.05,this.enableZoom=!0,this.zoomSpeed=1,this.enableRotate=!0,this.rotateSpeed=1,this.keyRotateSpeed=1,this.enablePan=!0,this.panSpeed=1,this.screenSpacePanning=!0,this.keyPanSpeed=7,this.zoomToCursor=!1,this.autoRotate=!1,this.autoRotateSpeed=2,this.keys={LEFT:"ArrowLeft",UP:"ArrowUp",RIGHT:"ArrowRight",BOTTOM:"ArrowDown"},this.mouseButtons={LEFT:Ks.ROTATE,MIDDLE:Ks.DOLLY,RIGHT:Ks.PAN},this.touches={ONE:js.ROTATE,TWO:js.DOLLY_PAN},this.target0=this.target.clone(),this.position0=this.object.position.clone(),this.zoom0=this.object.zoom,this._cursorStyle="auto",this._domElementKeyEvents=null,this._lastPosition=new H,this._lastQuaternion=new Un,this._lastTargetPosition=new H,this._quat=new Un().setFromUnitVectors(e.up,new H(0,1,0)),this._quatInverse=this._quat.clone().invert(),this._spherical=new mo,this._sphericalDelta=new mo,this._scale=1,this._panOffset=new H,this._rotateStart=new qe,this._rotateEnd=new qe,this._rotateDelta=new qe,this._panStart=new qe,this._panEnd=new qe,this._panDelta=new qe,this._dollyStart=new qe,this._dollyEnd=new qe,this._dollyDelta=new qe,this._dollyDirection=new H,this._mouse=new qe,this._performCursorZoom=!1,this._pointers=[],this._pointerPositions={},this._controlActive=!1,this._onPointerMove=Ow.bind(this),this._onPointerDown=Uw.bind(this),this._onPointerUp=Fw.bind(this),this._onContextMenu=Ww.bind(this),this._onMouseWheel=zw.bind(this),this._onKeyDown=Vw.bind(this),this._onTouchStart=Gw.bind(this),this._onTouchMove=Hw.bind(this),this._onMouseDown=kw.bind(this),this._onMouseMove=Bw.bind(this),this._interceptControlDown=Xw.bind(this),this._interceptControlUp=qw.bind(this),this.domElement!==null&&this.connect(this.domElement),this.update()}set cursorStyle(e){this._cursorStyle=e,e==="grab"?this.domElement.style.cursor="grab":this.domElement.style.cursor="auto"}get cursorStyle(){return this._cursorStyle}connect(e){super.connect(e),this.domElement.addEventListener("pointerdown",this._onPointerDown),this.domElement.addEventListener("pointercancel",this._onPointerUp),this.domElement.addEventListener("contextmenu",this._onContextMenu),this.domElement.addEventListener("wheel",this._onMouseWheel,{passive:!1}),this.domElement.ownerDocument.addEventListener("keydown",this._interceptControlDown,{passive:!0,capture:!0}),this.domElement.style.touchAction="none"}disconnect(){this.state=At.NONE,this.domElement.removeEventListener("pointerdown",this._onPointerDown),this.domElement.ownerDocument.removeEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.removeEventListener("pointerup",this._onPointerUp),this.domElement.removeEventListener("pointercancel",this._onPointerUp),this.domElement.removeEventListener("wheel",this._onMouseWheel),this.domElement.removeEventListener("contextmenu",this._onContextMenu),this.stopListenToKeyEvents(),this.domElement.ownerDocument.removeEventListener("keydown",this._interceptControlDown,{capture:!0}),this.domElement.ownerDocument.removeEventListener("keyup",this._interceptControlUp,{capture:!0}),this._controlActive=!1,this._pointers.length=0,this._pointerPositions={},this.domElement.style.touchAction="",this.domElement.style.cursor="auto"}dispose(){this.disconnect()}getPolarAngle(){return this._spherical.phi}getAzimuthalAngle(){return this._spherical.theta}getDistance(){return this.object.position.distanceTo(this.target)}listenToKeyEvents(e){e.addEventListener("keydown",this._onKeyDown),this._domElementKeyEvents=e}stopListenToKeyEvents(){this._domElementKeyEvents!==null&&(this._domElementKeyEvents.removeEventListener("keydown",this._onKeyDown),this._domElementKeyEvents=null)}saveState(){this.target0.copy(this.target),this.position0.copy(this.object.position),this.zoom0=this.object.zoom}reset(){this.target.copy(this.target0),this.object.position.copy(this.position0),this.object.zoom=this.zoom0,this.object.updateProjectionMatrix(),this.dispatchEvent(jg),this.update(),this.state=At.NONE}pan(e,t){this._pan(e,t),this.update()}dollyIn(e){this._dollyIn(e),this.update()}dollyOut(e){this._dollyOut(e),this.update()}rotateLeft(e){this._rotateLeft(e),this.update()}rotateUp(e){this._rotateUp(e),this.update()}update(e=null){let t=this.object.position;Tn.copy(t).sub(this.target),Tn.applyQuaternion(this._quat),this._spherical.setFromVector3(Tn),this.autoRotate&&this.state===At.NONE&&this._rotateLeft(this._getAutoRotationAngle(e)),this.enableDamping?(this._spherical.theta+=this._sphericalDelta.theta*this.dampingFactor,this._spherical.phi+=this._sphericalDelta.phi*this.dampingFactor):(this._spherical.theta+=this._sphericalDelta.theta,this._spherical.phi+=this._sphericalDelta.phi);let i=this.minAzimuthAngle,s=this.maxAzimuthAngle;isFinite(i)&&isFinite(s)&&(i<-Math.PI?i+=ai:i>Math.PI&&(i-=ai),s<-Math.PI?s+=ai:s>Math.PI&&(s-=ai),i<=s?this._spherical.theta=Math.max(i,Math.min(s,this._spherical.theta)):this._spherical.theta=this._spherical.theta>(i+s)/2?Math.max(i,this._spherical.theta):Math.min(s,this._spherical.theta)),this._spherical.phi=Math.max(this.minPolarAngle,Math.min(this.maxPolarAngle,this._spherical.phi)),this._spherical.makeSafe(),this.enableDamping===!0?this.target.addScaledVector(this._panOffset,this.dampingFactor):this.target.add(this._panOffset),this.target.sub(this.cursor),this.target.clampLength(this.minTargetRadius,this.maxTargetRadius),this.target.add(this.cursor);let r=!1;if(this.zoomToCursor&&this._performCursorZoom||this.object.isOrthographicCamera)this._spherical.radius=this._clampDistance(this._spherical.radius);else{let o=this._spherical.radius;this._spherical.radius=this._clampDistance(this._spherical.radius*this._scale),r=o!=this._spherical.radius}if(Tn.setFromSpherical(this._spherical),Tn.applyQuaternion(this._quatInverse),t.copy(this.target).add(Tn),this.object.lookAt(this.target),this.enableDamping===!0?(this._sphericalDelta.theta*=1-this.dampingFactor,this._sphericalDelta.phi*=1-this.dampingFactor,this._panOffset.multiplyScalar(1-this.dampingFactor)):(this._sphericalDelta.set(0,0,0),this._panOffset.set(0,0,0)),this.zoomToCursor&&this._performCursorZoom){let o=null;if(this.object.isPerspectiveCamera){let a=Tn.length();o=this._clampDistance(a*this._scale);let l=a-o;this.object.position.addScaledVector(this._dollyDirection,l),this.object.updateMatrixWorld(),r=!!l}else if(this.object.isOrthographicCamera){let a=new H(this._mouse.x,this._mouse.y,0);a.unproject(this.object);let l=this.object.zoom;this.object.zoom=Math.max(this.minZoom,Math.min(this.maxZoom,this.object.zoom/this._scale)),this.object.updateProjectionMatrix(),r=l!==this.object.zoom;let c=new H(this._mouse.x,this._mouse.y,0);c.unproject(this.object),this.object.position.sub(c).add(a),this.object.updateMatrixWorld(),o=Tn.length()}else console.warn("WARNING: OrbitControls.js encountered an unknown camera type - zoom to cursor disabled."),this.zoomToCursor=!1;o!==null&&(this.screenSpacePanning?this.target.set(0,0,-1).transformDirection(this.object.matrix).multiplyScalar(o).add(this.object.position):(wu.origin.copy(this.object.position),wu.direction.set(0,0,-1).transformDirection(this.object.matrix),Math.abs(this.object.up.dot(wu.direction))<Nw?this.object.lookAt(this.target):(Qg.setFromNormalAndCoplanarPoint(this.object.up,this.target),wu.intersectPlane(Qg,this.target))))}else if(this.object.isOrthographicCamera){let o=this.object.zoom;this.object.zoom=Math.max(this.minZoom,Math.min(this.maxZoom,this.object.zoom/this._scale)),o!==this.object.zoom&&(this.object.updateProjectionMatrix(),r=!0)}return this._scale=1,this._performCursorZoom=!1,r||this._lastPosition.distanceToSquared(this.object.position)>sf||8*(1-this._lastQuaternion.dot(this.object.quaternion))>sf||this._lastTargetPosition.distanceToSquared(this.target)>sf?(this.dispatchEvent(jg),this._lastPosition.copy(this.object.position),this._lastQuaternion.copy(this.object.quaternion),this._lastTargetPosition.copy(this.target),!0):!1}_getAutoRotationAngle(e){return e!==null?ai/60*this.autoRotateSpeed*e:ai/60/60*this.autoRotateSpeed}_getZoomScale(e){let t=Math.abs(e*.01);return Math.pow(.95,this.zoomSpeed*t)}_rotateLeft(e){this._sphericalDelta.theta-=e}_rotateUp(e){this._sphericalDelta.phi-=e}_panLeft(e,t){Tn.setFromMatrixColumn(t,0),Tn.multiplyScalar(-e),this._panOffset.add(Tn)}_panUp(e,t){this.screenSpacePanning===!0?Tn.setFromMatrixColumn(t,1):(Tn.setFromMatrixColumn(t,0),Tn.crossVectors(this.object.up,Tn)),Tn.multiplyScalar(e),this._panOffset.add(Tn)}_pan(e,t){let i=this.domElement;if(this.object.isPerspectiveCamera){let s=this.object.position;Tn.copy(s).sub(this.target);let r=Tn.length();r*=Math.tan(this.object.fov/2*Math.PI/180),this._panLeft(2*e*r/i.clientHeight,this.object.matrix),this._panUp(2*t*r/i.clientHeight,this.object.matrix)}else this.object.isOrthographicCamera?(this._panLeft(e*(this.object.right-this.object.left)/this.object.zoom/i.clientWidth,this.object.matrix),this._panUp(t*(this.object.top-this.object.bottom)/this.object.zoom/i.clientHeight,this.object.matrix)):(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - pan disabled."),this.enablePan=!1)}_dollyOut(e){this.object.isPerspectiveCamera||this.object.isOrthographicCamera?this._scale/=e:(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - dolly/zoom disabled."),this.enableZoom=!1)}_dollyIn(e){this.object.isPerspectiveCamera||this.object.isOrthographicCamera?this._scale*=e:(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - dolly/zoom disabled."),this.enableZoom=!1)}_updateZoomParameters(e,t){if(!this.zoomToCursor)return;this._performCursorZoom=!0;let i=this.domElement.getBoundingClientRect(),s=e-i.left,r=t-i.top,o=i.width,a=i.height;this._mouse.x=s/o*2-1,this._mouse.y=-(r/a)*2+1,this._dollyDirection.set(this._mouse.x,this._mouse.y,1).unproject(this.object).sub(this.object.position).normalize()}_clampDistance(e){return Math.max(this.minDistance,Math.min(this.maxDistance,e))}_handleMouseDownRotate(e){this._rotateStart.set(e.clientX,e.clientY)}_handleMouseDownDolly(e){this._updateZoomParameters(e.clientX,e.clientY),this._dollyStart.set(e.clientX,e.clientY)}_handleMouseDownPan(e){this._panStart.set(e.clientX,e.clientY)}_handleMouseMoveRotate(e){this._rotateEnd.set(e.clientX,e.clientY),this._rotateDelta.subVectors(this._rotateEnd,this._rotateStart).multiplyScalar(this.rotateSpeed);let t=this.domElement;this._rotateLeft(ai*this._rotateDelta.x/t.clientHeight),this._rotateUp(ai*this._rotateDelta.y/t.clientHeight),this._rotateStart.copy(this._rotateEnd),this.update()}_handleMouseMoveDolly(e){this._dollyEnd.set(e.clientX,e.clientY),this._dollyDelta.subVectors(this._dollyEnd,this._dollyStart),this._dollyDelta.y>0?this._dollyOut(this._getZoomScale(this._dollyDelta.y)):this._dollyDelta.y<0&&this._dollyIn(this._getZoomScale(this._dollyDelta.y)),this._dollyStart.copy(this._dollyEnd),this.zoomToCursor&&(this._performCursorZoom=!0,this._dollyDirection.set(this._mouse.x,this._mouse.y,1).unproject(this.object).sub(this.object.position).normalize()),this.update()}_handleMouseMovePan(e){this._panEnd.set(e.clientX,e.clientY),this._panDelta.subVectors(this._panEnd,this._panStart).multiplyScalar(this.panSpeed),this._pan(this._panDelta.x,this._panDelta.y),this._panStart.copy(this._panEnd),this.update()}_handleMouseWheel(e){this._updateZoomParameters(e.clientX,e.clientY),e.deltaY<0?this._dollyIn(this._getZoomScale(e.deltaY)):e.deltaY>0&&this._dollyOut(this._getZoomScale(e.deltaY)),this.update()}_handleKeyDown(e){let t=!1;switch(e.code){case this.keys.UP:e.ctrlKey||e.metaKey||e.shiftKey?this.enableRotate&&this._rotateUp(ai*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(0,this.keyPanSpeed),t=!0;break;case this.keys.BOTTOM:e.ctrlKey||e.metaKey||e.shiftKey?this.enableRotate&&this._rotateUp(-ai*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(0,-this.keyPanSpeed),t=!0;break;case this.keys.LEFT:e.ctrlKey||e.metaKey||e.shiftKey?this.enableRotate&&this._rotateLeft(ai*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(this.keyPanSpeed,0),t=!0;break;case this.keys.RIGHT:e.ctrlKey||e.metaKey||e.shiftKey?this.enableRotate&&this._rotateLeft(-ai*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(-this.keyPanSpeed,0),t=!0;break}t&&(e.preventDefault(),this.update())}_handleTouchStartRotate(e){if(this._pointers.length===1)this._rotateStart.set(e.pageX,e.pageY);else{let t=this._getSecondPointerPosition(e),i=.5*(e.pageX+t.x),s=.5*(e.pageY+t.y);this._rotateStart.set(i,s)}}_handleTouchStartPan(e){if(this._pointers.length===1)this._panStart.set(e.pageX,e.pageY);else{let t=this._getSecondPointerPosition(e),i=.5*(e.pageX+t.x),s=.5*(e.pageY+t.y);this._panStart.set(i,s)}}_handleTouchStartDolly(e){let t=this._getSecondPointerPosition(e),i=e.pageX-t.x,s=e.pageY-t.y,r=Math.sqrt(i*i+s*s);this._dollyStart.set(0,r)}_handleTouchStartDollyPan(e){this.enableZoom&&this._handleTouchStartDolly(e),this.enablePan&&this._handleTouchStartPan(e)}_handleTouchStartDollyRotate(e){this.enableZoom&&this._handleTouchStartDolly(e),this.enableRotate&&this._handleTouchStartRotate(e)}_handleTouchMoveRotate(e){if(this._pointers.length==1)this._rotateEnd.set(e.pageX,e.pageY);else{let i=this._getSecondPointerPosition(e),s=.5*(e.pageX+i.x),r=.5*(e.pageY+i.y);this._rotateEnd.set(s,r)}this._rotateDelta.subVectors(this._rotateEnd,this._rotateStart).multiplyScalar(this.rotateSpeed);let t=this.domElement;this._rotateLeft(ai*this._rotateDelta.x/t.clientHeight),this._rotateUp(ai*this._rotateDelta.y/t.clientHeight),this._rotateStart.copy(this._rotateEnd)}_handleTouchMovePan(e){if(this._pointers.length===1)this._panEnd.set(e.pageX,e.pageY);else{let t=this._getSecondPointerPosition(e),i=.5*(e.pageX+t.x),s=.5*(e.pageY+t.y);this._panEnd.set(i,s)}this._panDelta.subVectors(this._panEnd,this._panStart).multiplyScalar(this.panSpeed),this._pan(this._panDelta.x,this._panDelta.y),this._panStart.copy(this._panEnd)}_handleTouchMoveDolly(e){let t=this._getSecondPointerPosition(e),i=e.pageX-t.x,s=e.pageY-t.y,r=Math.sqrt(i*i+s*s);this._dollyEnd.set(0,r),this._dollyDelta.set(0,Math.pow(this._dollyEnd.y/this._dollyStart.y,this.zoomSpeed)),this._dollyOut(this._dollyDelta.y),this._dollyStart.copy(this._dollyEnd);let o=(e.pageX+t.x)*.5,a=(e.pageY+t.y)*.5;this._updateZoomParameters(o,a)}_handleTouchMoveDollyPan(e){this.enableZoom&&this._handleTouchMoveDolly(e),this.enablePan&&this._handleTouchMovePan(e)}_handleTouchMoveDollyRotate(e){this.enableZoom&&this._handleTouchMoveDolly(e),this.enableRotate&&this._handleTouchMoveRotate(e)}_addPointer(e){this._pointers.push(e.pointerId)}_removePointer(e){delete this._pointerPositions[e.pointerId];for(let t=0;t<this._pointers.length;t++)if(this._pointers[t]==e.pointerId){this._pointers.splice(t,1);return}}_isTrackingPointer(e){for(let t=0;t<this._pointers.length;t++)if(this._pointers[t]==e.pointerId)return!0;return!1}_trackPointer(e){let t=this._pointerPositions[e.pointerId];t===void 0&&(t=new qe,this._pointerPositions[e.pointerId]=t),t.set(e.pageX,e.pageY)}_getSecondPointerPosition(e){let t=e.pointerId===this._pointers[0]?this._pointers[1]:this._pointers[0];return this._pointerPositions[t]}_customWheelEvent(e){let t=e.deltaMode,i={clientX:e.clientX,clientY:e.clientY,deltaY:e.deltaY};switch(t){case 1:i.deltaY*=16;break;case 2:i.deltaY*=100;break}return e.ctrlKey&&!this._controlActive&&(i.deltaY*=10),i}};function Uw(n){this.enabled!==!1&&(this._pointers.length===0&&(this.domElement.setPointerCapture(n.pointerId),this.domElement.ownerDocument.addEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.addEventListener("pointerup",this._onPointerUp)),!this._isTrackingPointer(n)&&(this._addPointer(n),n.pointerType==="touch"?this._onTouchStart(n):this._onMouseDown(n),this._cursorStyle==="grab"&&(this.domElement.style.cursor="grabbing")))}function Ow(n){this.enabled!==!1&&(n.pointerType==="touch"?this._onTouchMove(n):this._onMouseMove(n))}function Fw(n){switch(this._removePointer(n),this._pointers.length){case 0:this.domElement.releasePointerCapture(n.pointerId),this.domElement.ownerDocument.removeEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.removeEventListener("pointerup",this._onPointerUp),this.dispatchEvent(e_),this.state=At.NONE,this._cursorStyle==="grab"&&(this.domElement.style.cursor="grab");break;case 1:let e=this._pointers[0],t=this._pointerPositions[e];this._onTouchStart({pointerId:e,pageX:t.x,pageY:t.y});break}}function kw(n){let e;switch(n.button){case 0:e=this.mouseButtons.LEFT;break;case 1:e=this.mouseButtons.MIDDLE;break;case 2:e=this.mouseButtons.RIGHT;break;default:e=-1}switch(e){case Ks.DOLLY:if(this.enableZoom===!1)return;this._handleMouseDownDolly(n),this.state=At.DOLLY;break;case Ks.ROTATE:if(n.ctrlKey||n.metaKey||n.shiftKey){if(this.enablePan===!1)return;this._handleMouseDownPan(n),this.state=At.PAN}else{if(this.enableRotate===!1)return;this._handleMouseDownRotate(n),this.state=At.ROTATE}break;case Ks.PAN:if(n.ctrlKey||n.metaKey||n.shiftKey){if(this.enableRotate===!1)return;this._handleMouseDownRotate(n),this.state=At.ROTATE}else{if(this.enablePan===!1)return;this._handleMouseDownPan(n),this.state=At.PAN}break;default:this.state=At.NONE}this.state!==At.NONE&&this.dispatchEvent(rf)}function Bw(n){switch(this.state){case At.ROTATE:if(this.enableRotate===!1)return;this._handleMouseMoveRotate(n);break;case At.DOLLY:if(this.enableZoom===!1)return;this._handleMouseMoveDolly(n);break;case At.PAN:if(this.enablePan===!1)return;this._handleMouseMovePan(n);break}}function zw(n){this.enabled===!1||this.enableZoom===!1||this.state!==At.NONE||(n.preventDefault(),this.dispatchEvent(rf),this._handleMouseWheel(this._customWheelEvent(n)),this.dispatchEvent(e_))}function Vw(n){this.enabled!==!1&&this._handleKeyDown(n)}function Gw(n){switch(this._trackPointer(n),this._pointers.length){case 1:switch(this.touches.ONE){case js.ROTATE:if(this.enableRotate===!1){this.state=At.NONE;break}this._handleTouchStartRotate(n),this.state=At.TOUCH_ROTATE;break;case js.PAN:if(this.enablePan===!1){this.state=At.NONE;break}this._handleTouchStartPan(n),this.state=At.TOUCH_PAN;break;default:this.state=At.NONE}break;case 2:switch(this.touches.TWO){case js.DOLLY_PAN:if(this.enableZoom===!1&&this.enablePan===!1)return;this._handleTouchStartDollyPan(n),this.state=At.TOUCH_DOLLY_PAN;break;case js.DOLLY_ROTATE:if(this.enableZoom===!1&&this.enableRotate===!1)return;this._handleTouchStartDollyRotate(n),this.state=At.TOUCH_DOLLY_ROTATE;break;default:this.state=At.NONE}break;default:this.state=At.NONE}this.state!==At.NONE&&this.dispatchEvent(rf)}function Hw(n){switch(this._trackPointer(n),this.state){case At.TOUCH_ROTATE:if(this.enableRotate===!1)return;this._handleTouchMoveRotate(n),this.update();break;case At.TOUCH_PAN:if(this.enablePan===!1)return;this._handleTouchMovePan(n),this.update();break;case At.TOUCH_DOLLY_PAN:if(this.enableZoom===!1&&this.enablePan===!1)return;this._handleTouchMoveDollyPan(n),this.update();break;case At.TOUCH_DOLLY_ROTATE:if(this.enableZoom===!1&&this.enableRotate===!1)return;this._handleTouchMoveDollyRotate(n),this.update();break;default:this.state=At.NONE}}function Ww(n){this.enabled!==!1&&n.preventDefault()}function Xw(n){n.key==="Control"&&(this._controlActive=!0,this.domElement.ownerDocument.addEventListener("keyup",this._interceptControlUp,{passive:!0,capture:!0}))}function qw(n){n.key==="Control"&&(this._controlActive=!1,this.domElement.ownerDocument.removeEventListener("keyup",this._interceptControlUp,{passive:!0,capture:!0}))}var Yw=new tt("#3d8bd4"),t_=new tt("#3fae6b"),$w=new tt("#d64545"),s_=new tt("#8a8f98"),Zw=.9,n_=.3,Jw=new H(0,1,0),Kw=12,jw=4,Qw=.04,ni=n=>new H(n[0]??0,n[1]??0,n[2]??0);function of(n,e,t){if(n===null||e===null||t===null||n<e/4)return s_.clone();let i=Math.min(Math.max((n-e)/(t-e),0),1);return i<.5?Yw.clone().lerp(t_,2*i):t_.clone().lerp($w,2*i-1)}function eT(n){let e=n.body?new kn(ni(n.body.min_m),ni(n.body.max_m)):new kn().setFromPoints(n.anchor_points_m.map(ni)),t=e.getSize(new H);return t.set(...t.toArray().map(i=>Math.max(i,Qw))),{centre:e.getCenter(new H),size:t}}function Eu(n,e,t){let i=new uo(new Ta(new Ts(n.x,n.y,n.z)),t);return i.position.copy(e),i}function i_(n,e,t){let i=document.createElement("canvas");i.width=i.height=64;let s=i.getContext("2d");s.fillStyle="#1f4f80",s.arc(32,32,30,0,2*Math.PI),s.fill(),s.fillStyle="#ffffff",s.font="600 38px system-ui, sans-serif",s.textAlign="center",s.textBaseline="middle",s.fillText(n,32,34);let r=new ba(i);r.colorSpace=Kn;let o=new xa(new lo({map:r,depthTest:!1}));return o.position.copy(e),o.scale.setScalar(t),o.renderOrder=1,o}var Mo=class{constructor(e){this.host=e;this.#e=new bu({antialias:!0,alpha:!0}),this.#e.setPixelRatio(Math.min(devicePixelRatio,2)),e.append(this.#e.domElement),this.#r=new Tu(this.#n,this.#e.domElement),this.#r.addEventListener("change",()=>this.#u());let t=new Na("#ffffff",1.6);t.position.set(3,8,5),this.#t.add(new Ia("#ffffff","#7788aa",1.6),t,this.#i),this.#f=new ResizeObserver(()=>this.#x()),this.#f.observe(e),this.#x()}host;#e;#t=new pa;#n=new jn(40,1,.05,500);#r;#i=new Di;#s=new Di;#o=new Di;#l=[];#a=[];#c=null;#m=new fo({color:"#ffb454",transparent:!0,opacity:n_,roughness:.6});numbered=!1;#h=!1;#d=!1;#g="";#f;close(){this.#f.disconnect(),this.#r.dispose(),this.#e.dispose(),this.#e.domElement.remove()}describe(e){this.#c=e,this.#i.clear(),this.#s.clear(),this.#o.clear();let t=e.platform;if(!t)return;let i=t.workspace_min_m.length===2;this.#i.rotation.x=i?0:-Math.PI/2;let s=t.exit_points_m.map(ni),r=new Bn().setFromPoints(s);this.numbered&&this.#v(s,t.anchor_points_m.map(ni)),this.#i.add(new va(r,new ho({color:"#7a8797",size:9,sizeAttenuation:!1}))),this.#y(t),this.#b(t),this.#a=s;let o=new kn().setFromPoints(s).getSize(new H).length()/700;this.#l=s.map(()=>new ri(new wa(o,o,1,6),new co({color:s_}))),this.#i.add(this.#s,this.#o,...this.#l),this.#o.visible=!1,this.#p(this.#s,ni(t.home_m),new Un),this.#_(null),this.#S(s,i),this.#M(s,t,i)}show(e){if(!this.#c?.platform)return;let i=[e.pose.map(d=>d?.toFixed(4)),e.tension_N.map(d=>d&&Math.round(d/2))].join();if(i===this.#g)return;this.#g=i;let[s,r,o,a,l,c,u]=e.pose;if(this.#m.opacity=s==null?n_:Zw,s!=null&&r!=null){let d=a==null?new Un:new Un(l??0,c??0,u??0,a);this.#p(this.#s,new H(s,r,o??0),d)}this.#_(e),this.#u()}aim(e,t){if(this.#o.visible=e!==null,e){let i=t?.length===1?new H(0,0,t[0]):ni(t??[]),s=i.length(),r=new Un().setFromAxisAngle(s?i.divideScalar(s):new H(0,0,1),s);this.#p(this.#o,ni(e),r)}this.#u()}#v(e,t){let i=new kn().setFromPoints(e).getSize(new H).length();e.forEach((r,o)=>this.#i.add(i_(String(o+1),r,i/18)));let s=t.map((r,o)=>t.slice(0,o).filter(a=>a.distanceTo(r)<1e-6).length);t.forEach((r,o)=>{let a=i_(String(o+1),r,i/30);a.center.set(.5-.8*s[o],.5),this.#s.add(a)})}#y(e){let t=new kn(ni(e.workspace_min_m),ni(e.workspace_max_m)),i=new Ca({color:"#9a6fd0",dashSize:.06,gapSize:.04}),s=Eu(t.getSize(new H),t.getCenter(new H),i);s.computeLineDistances(),this.#i.add(s);for(let r of e.obstacles){let o=new kn(ni(r.min_m),ni(r.max_m));this.#i.add(Eu(o.getSize(new H),o.getCenter(new H),new es({color:"#b02f2f"})))}}#b(e){let{centre:t,size:i}=eT(e),s=new ri(new Ts(i.x,i.y,i.z),this.#m);s.position.copy(t),this.#s.add(s,Eu(i,t,new es({color:"#8a5a10"})));let r=new Aa(Math.max(i.length()/60,.006),12,8);for(let o of e.anchor_points_m){let a=new ri(r,new fo({color:"#444c57"}));a.position.copy(ni(o)),this.#s.add(a)}this.#o.add(Eu(i,t,new es({color:"#9a6fd0"})))}#S(e,t){this.#t.children.filter(c=>c instanceof go).forEach(c=>this.#t.remove(c));let i=new kn().setFromPoints(e),s=i.getSize(new H),r=1.2*Math.max(s.x,t?s.x/2:s.y),o=new go(r,Math.round(r*2),"#8894a3","#8894a3"),a=i.getCenter(new H),l=t?i.min.y:Math.min(i.min.z,0);o.position.set(a.x,l,t?0:-a.y),o.material.transparent=!0,o.material.opacity=.25,this.#t.add(o)}#M(e,t,i){this.#i.updateMatrixWorld(!0);let s=new kn().setFromPoints([...e,ni(t.home_m)].map(l=>this.#i.localToWorld(l.clone()))),r=s.getCenter(new H),o=s.getSize(new H).length(),a=i?new H(.1,.08,1):new H(.75,.5,1);this.#n.position.copy(r).addScaledVector(a.normalize(),o*(i?1.15:1.2)),this.#r.target.copy(r),this.#r.update()}#p(e,t,i){e.position.copy(t),e.quaternion.copy(i),e.updateMatrix()}#_(e){let{platform:t,limits:i}=this.#c;this.#l.forEach((s,r)=>{let o=ni(t.anchor_points_m[r]).applyMatrix4(this.#s.matrix),a=o.clone().sub(this.#a[r]);s.position.copy(o).add(this.#a[r]).divideScalar(2),s.scale.y=a.length(),s.quaternion.setFromUnitVectors(Jw,a.normalize());let l=e?.tension_N[r]??null,c=of(l,i.tension_min_N[r]??null,i.tension_max_N[r]??null);s.material.color.copy(c)})}#x(){let{clientWidth:e,clientHeight:t}=this.host;!e||!t||(this.#e.setSize(e,t),this.#n.aspect=e/t,this.#n.updateProjectionMatrix(),this.#u())}#u(){if(this.#h){this.#d=!0;return}this.#h=!0,requestAnimationFrame(()=>{let e=performance.now();this.#e.render(this.#t,this.#n),this.#e.getContext().finish();let t=performance.now()-e;setTimeout(()=>{this.#h=!1,this.#d&&this.#u(),this.#d=!1},t>Kw?jw*t:0)})}};var tT="uplot",nT="u-hz",iT="u-vt",sT="u-title",rT="u-wrap",oT="u-under",aT="u-over",lT="u-axis",br="u-off",cT="u-select",uT="u-cursor-x",hT="u-cursor-y",dT="u-cursor-pt",fT="u-legend",pT="u-live",mT="u-inline",gT="u-series",_T="u-marker",r_="u-label",xT="u-value",Za="width",Ja="height";var o_="bottom",wo="left",af="right",wf="#000",a_=wf+"0",lf="mousemove",l_="mousedown",cf="mouseup",c_="mouseenter",u_="mouseleave",h_="dblclick",vT="resize",yT="scroll",d_="change",Iu="dppxchange",Tf="--",Io=typeof window<"u",pf=Io?document:null,Eo=Io?window:null,bT=Io?navigator:null,Ct,Au;function mf(){let n=devicePixelRatio;Ct!=n&&(Ct=n,Au&&_f(d_,Au,mf),Au=matchMedia(`(min-resolution: ${Ct-.001}dppx) and (max-resolution: ${Ct+.001}dppx)`),Sr(d_,Au,mf),Eo.dispatchEvent(new CustomEvent(Iu)))}function _i(n,e){if(e!=null){let t=n.classList;!t.contains(e)&&t.add(e)}}function gf(n,e){let t=n.classList;t.contains(e)&&t.remove(e)}function $t(n,e,t){n.style[e]=t+"px"}function Vi(n,e,t,i){let s=pf.createElement(n);return e!=null&&_i(s,e),t?.insertBefore(s,i),s}function wi(n,e){return Vi("div",n,e)}var f_=new WeakMap;function os(n,e,t,i,s){let r="translate("+e+"px,"+t+"px)",o=f_.get(n);r!=o&&(n.style.transform=r,f_.set(n,r),e<0||t<0||e>i||t>s?_i(n,br):gf(n,br))}var p_=new WeakMap;function m_(n,e,t){let i=e+t,s=p_.get(n);i!=s&&(p_.set(n,i),n.style.background=e,n.style.borderColor=t)}var g_=new WeakMap;function __(n,e,t,i){let s=e+""+t,r=g_.get(n);s!=r&&(g_.set(n,s),n.style.height=t+"px",n.style.width=e+"px",n.style.marginLeft=i?-e/2+"px":0,n.style.marginTop=i?-t/2+"px":0)}var Ef={passive:!0},ST={...Ef,capture:!0};function Sr(n,e,t,i){e.addEventListener(n,t,i?ST:Ef)}function _f(n,e,t,i){e.removeEventListener(n,t,Ef)}Io&&mf();function Gi(n,e,t,i){let s;t=t||0,i=i||e.length-1;let r=i<=2147483647;for(;i-t>1;)s=r?t+i>>1:xi((t+i)/2),e[s]<n?t=s:i=s;return n-e[t]<=e[i]-n?t:i}function X_(n){return(t,i,s)=>{let r=-1,o=-1;for(let a=i;a<=s;a++)if(n(t[a])){r=a;break}for(let a=s;a>=i;a--)if(n(t[a])){o=a;break}return[r,o]}}var q_=n=>n!=null,Y_=n=>n!=null&&n>0,Nu=X_(q_),MT=X_(Y_);function wT(n,e,t,i=0,s=!1){let r=s?MT:Nu,o=s?Y_:q_;[e,t]=r(n,e,t);let a=n[e],l=n[e];if(e>-1)if(i==1)a=n[e],l=n[t];else if(i==-1)a=n[t],l=n[e];else for(let c=e;c<=t;c++){let u=n[c];o(u)&&(u<a?a=u:u>l&&(l=u))}return[a??zt,l??-zt]}function Uu(n,e,t,i){let s=y_(n),r=y_(e);n==e&&(s==-1?(n*=t,e/=t):(n/=t,e*=t));let o=t==10?Rs:$_,a=s==1?xi:Ti,l=r==1?Ti:xi,c=a(o(An(n))),u=l(o(An(e))),d=Ao(t,c),h=Ao(t,u);return t==10&&(c<0&&(d=Vt(d,-c)),u<0&&(h=Vt(h,-u))),i||t==2?(n=d*s,e=h*r):(n=j_(n,d),e=Ou(e,h)),[n,e]}function Af(n,e,t,i){let s=Uu(n,e,t,i);return n==0&&(s[0]=0),e==0&&(s[1]=0),s}var Cf=.1,x_={mode:3,pad:Cf},ja={pad:0,soft:null,mode:0},TT={min:ja,max:ja};function Lu(n,e,t,i){return Fu(t)?v_(n,e,t):(ja.pad=t,ja.soft=i?0:null,ja.mode=i?3:0,v_(n,e,TT))}function Tt(n,e){return n??e}function ET(n,e,t){for(e=Tt(e,0),t=Tt(t,n.length-1);e<=t;){if(n[e]!=null)return!0;e++}return!1}function v_(n,e,t){let i=t.min,s=t.max,r=Tt(i.pad,0),o=Tt(s.pad,0),a=Tt(i.hard,-zt),l=Tt(s.hard,zt),c=Tt(i.soft,zt),u=Tt(s.soft,-zt),d=Tt(i.mode,0),h=Tt(s.mode,0),f=e-n,m=Rs(f),y=ii(An(n),An(e)),g=Rs(y),_=An(g-m);(f<1e-24||_>10)&&(f=0,(n==0||e==0)&&(f=1e-24,d==2&&c!=zt&&(r=0),h==2&&u!=-zt&&(o=0)));let b=f||y||1e3,C=Rs(b),S=Ao(10,xi(C)),P=b*(f==0?n==0?.1:1:r),A=Vt(j_(n-P,S/10),24),x=n>=c&&(d==1||d==3&&A<=c||d==2&&A>=c)?c:zt,w=ii(a,A<x&&n>=x?x:Hi(x,A)),F=b*(f==0?e==0?.1:1:o),D=Vt(Ou(e+F,S/10),24),L=e<=u&&(h==1||h==3&&D>=u||h==2&&D<=u)?u:-zt,B=Hi(l,D>L&&e<=L?L:ii(L,D));return w==B&&w==0&&(B=100),[w,B]}var AT=new Intl.NumberFormat(Io?bT.language:"en-US"),Rf=n=>AT.format(n),vi=Math,Pu=vi.PI,An=vi.abs,xi=vi.floor,En=vi.round,Ti=vi.ceil,Hi=vi.min,ii=vi.max,Ao=vi.pow,y_=vi.sign,Rs=vi.log10,$_=vi.log2,CT=(n,e=1)=>vi.sinh(n)*e,uf=(n,e=1)=>vi.asinh(n/e),zt=1/0;function b_(n){return(Rs((n^n>>31)-(n>>31))|0)+1}function xf(n,e,t){return Hi(ii(n,e),t)}function Z_(n){return typeof n=="function"}function bt(n){return Z_(n)?n:()=>n}var RT=()=>{},J_=n=>n,K_=(n,e)=>e,PT=n=>null,S_=n=>!0,M_=(n,e)=>n==e,IT=/\.\d*?(?=9{6,}|0{6,})/gm,Mr=n=>{if(e0(n)||ir.has(n))return n;let e=`${n}`,t=e.match(IT);if(t==null)return n;let i=t[0].length-1;if(e.indexOf("e-")!=-1){let[s,r]=e.split("e");return+`${Mr(s)}e${r}`}return Vt(n,i)};function vr(n,e){return Mr(Vt(Mr(n/e))*e)}function Ou(n,e){return Mr(Ti(Mr(n/e))*e)}function j_(n,e){return Mr(xi(Mr(n/e))*e)}function Vt(n,e=0){if(e0(n))return n;let t=10**e,i=n*t*(1+Number.EPSILON);return En(i)/t}var ir=new Map;function Q_(n){return((""+n).split(".")[1]||"").length}function el(n,e,t,i){let s=[],r=i.map(Q_);for(let o=e;o<t;o++){let a=An(o),l=Vt(Ao(n,o),a);for(let c=0;c<i.length;c++){let u=n==10?+`${i[c]}e${o}`:i[c]*l,d=(o>=0?0:a)+(o>=r[c]?0:r[c]),h=n==10?u:Vt(u,d);s.push(h),ir.set(h,d)}}return s}var Qa={},Pf=[],Co=[null,null],nr=Array.isArray,e0=Number.isInteger,LT=n=>n===void 0;function w_(n){return typeof n=="string"}function Fu(n){let e=!1;if(n!=null){let t=n.constructor;e=t==null||t==Object}return e}function DT(n){return n!=null&&typeof n=="object"}var NT=Object.getPrototypeOf(Uint8Array),t0="__proto__";function Ro(n,e=Fu){let t;if(nr(n)){let i=n.find(s=>s!=null);if(nr(i)||e(i)){t=Array(n.length);for(let s=0;s<n.length;s++)t[s]=Ro(n[s],e)}else t=n.slice()}else if(n instanceof NT)t=n.slice();else if(e(n)){t={};for(let i in n)i!=t0&&(t[i]=Ro(n[i],e))}else t=n;return t}function xn(n){let e=arguments;for(let t=1;t<e.length;t++){let i=e[t];for(let s in i)s!=t0&&(Fu(n[s])?xn(n[s],Ro(i[s])):n[s]=Ro(i[s]))}return n}var UT=0,OT=1,FT=2;function kT(n,e,t){for(let i=0,s,r=-1;i<e.length;i++){let o=e[i];if(o>r){for(s=o-1;s>=0&&n[s]==null;)n[s--]=null;for(s=o+1;s<t&&n[s]==null;)n[r=s++]=null}}}function BT(n,e){if(GT(n)){let o=n[0].slice();for(let a=1;a<n.length;a++)o.push(...n[a].slice(1));return HT(o[0])||(o=VT(o)),o}let t=new Set;for(let o=0;o<n.length;o++){let l=n[o][0],c=l.length;for(let u=0;u<c;u++)t.add(l[u])}let i=[Array.from(t).sort((o,a)=>o-a)],s=i[0].length,r=new Map;for(let o=0;o<s;o++)r.set(i[0][o],o);for(let o=0;o<n.length;o++){let a=n[o],l=a[0];for(let c=1;c<a.length;c++){let u=a[c],d=Array(s).fill(void 0),h=e?e[o][c]:OT,f=[];for(let m=0;m<u.length;m++){let y=u[m],g=r.get(l[m]);y===null?h!=UT&&(d[g]=y,h==FT&&f.push(g)):d[g]=y}kT(d,f,s),i.push(d)}}return i}var zT=typeof queueMicrotask>"u"?n=>Promise.resolve().then(n):queueMicrotask;function VT(n){let e=n[0],t=e.length,i=Array(t);for(let r=0;r<i.length;r++)i[r]=r;i.sort((r,o)=>e[r]-e[o]);let s=[];for(let r=0;r<n.length;r++){let o=n[r],a=Array(t);for(let l=0;l<t;l++)a[l]=o[i[l]];s.push(a)}return s}function GT(n){let e=n[0][0],t=e.length;for(let i=1;i<n.length;i++){let s=n[i][0];if(s.length!=t)return!1;if(s!=e){for(let r=0;r<t;r++)if(s[r]!=e[r])return!1}}return!0}function HT(n,e=100){let t=n.length;if(t<=1)return!0;let i=0,s=t-1;for(;i<=s&&n[i]==null;)i++;for(;s>=i&&n[s]==null;)s--;if(s<=i)return!0;let r=ii(1,xi((s-i+1)/e));for(let o=n[i],a=i+r;a<=s;a+=r){let l=n[a];if(l!=null){if(l<=o)return!1;o=l}}return!0}var n0=["January","February","March","April","May","June","July","August","September","October","November","December"],i0=["Sunday","Monday","Tuesday","Wednesday","Thursday","Friday","Saturday"];function s0(n){return n.slice(0,3)}var WT=i0.map(s0),XT=n0.map(s0),qT={MMMM:n0,MMM:XT,WWWW:i0,WWW:WT};function $a(n){return(n<10?"0":"")+n}function YT(n){return(n<10?"00":n<100?"0":"")+n}var $T={YYYY:n=>n.getFullYear(),YY:n=>(n.getFullYear()+"").slice(2),MMMM:(n,e)=>e.MMMM[n.getMonth()],MMM:(n,e)=>e.MMM[n.getMonth()],MM:n=>$a(n.getMonth()+1),M:n=>n.getMonth()+1,DD:n=>$a(n.getDate()),D:n=>n.getDate(),WWWW:(n,e)=>e.WWWW[n.getDay()],WWW:(n,e)=>e.WWW[n.getDay()],HH:n=>$a(n.getHours()),H:n=>n.getHours(),h:n=>{let e=n.getHours();return e==0?12:e>12?e-12:e},AA:n=>n.getHours()>=12?"PM":"AM",aa:n=>n.getHours()>=12?"pm":"am",a:n=>n.getHours()>=12?"p":"a",mm:n=>$a(n.getMinutes()),m:n=>n.getMinutes(),ss:n=>$a(n.getSeconds()),s:n=>n.getSeconds(),fff:n=>YT(n.getMilliseconds())};function If(n,e){e=e||qT;let t=[],i=/\{([a-z]+)\}|[^{]+/gi,s;for(;s=i.exec(n);)t.push(s[0][0]=="{"?$T[s[1]]:s[0]);return r=>{let o="";for(let a=0;a<t.length;a++)o+=typeof t[a]=="string"?t[a]:t[a](r,e);return o}}var ZT=new Intl.DateTimeFormat().resolvedOptions().timeZone;function JT(n,e){let t;return e=="UTC"||e=="Etc/UTC"?t=new Date(+n+n.getTimezoneOffset()*6e4):e==ZT?t=n:(t=new Date(n.toLocaleString("en-US",{timeZone:e})),t.setMilliseconds(n.getMilliseconds())),t}var r0=n=>n%1==0,Du=[1,2,2.5,5],KT=el(10,-32,0,Du),o0=el(10,0,32,Du),jT=o0.filter(r0),yr=KT.concat(o0),Lf=`
`,a0="{YYYY}",T_=Lf+a0,l0="{M}/{D}",Ka=Lf+l0,Cu=Ka+"/{YY}",c0="{aa}",QT="{h}:{mm}",To=QT+c0,E_=Lf+To,A_=":{ss}",Pt=null;function u0(n){let e=n*1e3,t=e*60,i=t*60,s=i*24,r=s*30,o=s*365,l=(n==1?el(10,0,3,Du).filter(r0):el(10,-3,0,Du)).concat([e,e*5,e*10,e*15,e*30,t,t*5,t*10,t*15,t*30,i,i*2,i*3,i*4,i*6,i*8,i*12,s,s*2,s*3,s*4,s*5,s*6,s*7,s*8,s*9,s*10,s*15,r,r*2,r*3,r*4,r*6,o,o*2,o*5,o*10,o*25,o*50,o*100]),c=[[o,a0,Pt,Pt,Pt,Pt,Pt,Pt,1],[s*28,"{MMM}",T_,Pt,Pt,Pt,Pt,Pt,1],[s,l0,T_,Pt,Pt,Pt,Pt,Pt,1],[i,"{h}"+c0,Cu,Pt,Ka,Pt,Pt,Pt,1],[t,To,Cu,Pt,Ka,Pt,Pt,Pt,1],[e,A_,Cu+" "+To,Pt,Ka+" "+To,Pt,E_,Pt,1],[n,A_+".{fff}",Cu+" "+To,Pt,Ka+" "+To,Pt,E_,Pt,1]];function u(d){return(h,f,m,y,g,_)=>{let b=[],C=g>=o,S=g>=r&&g<o,P=d(m),A=Vt(P*n,3),x=hf(P.getFullYear(),C?0:P.getMonth(),S||C?1:P.getDate()),w=Vt(x*n,3);if(S||C){let F=S?g/r:0,D=C?g/o:0,L=A==w?A:Vt(hf(x.getFullYear()+D,x.getMonth()+F,1)*n,3),B=new Date(En(L/n)),V=B.getFullYear(),U=B.getMonth();for(let X=0;L<=y;X++){let $=hf(V+D*X,U+F*X,1),W=$-d(Vt($*n,3));L=Vt((+$+W)*n,3),L<=y&&b.push(L)}}else{let F=g>=s?s:g,D=xi(m)-xi(A),L=w+D+Ou(A-w,F);b.push(L);let B=d(L),V=B.getHours()+B.getMinutes()/t+B.getSeconds()/i,U=g/i,X=h.axes[f]._space,$=_/X;for(;L=Vt(L+g,n==1?0:3),!(L>y);)if(U>1){let W=xi(Vt(V+U,6))%24,Q=d(L).getHours()-W;Q>1&&(Q=-1),L-=Q*i,V=(V+U)%24;let se=b[b.length-1];Vt((L-se)/g,3)*$>=.7&&b.push(L)}else b.push(L)}return b}}return[l,c,u]}var[e1,t1,n1]=u0(1),[i1,s1,r1]=u0(.001);el(2,-53,53,[1]);function C_(n,e){return n.map(t=>t.map((i,s)=>s==0||s==8||i==null?i:e(s==1||t[8]==0?i:t[1]+i)))}function R_(n,e){return(t,i,s,r,o)=>{let a=e.find(m=>o>=m[0])||e[e.length-1],l,c,u,d,h,f;return i.map(m=>{let y=n(m),g=y.getFullYear(),_=y.getMonth(),b=y.getDate(),C=y.getHours(),S=y.getMinutes(),P=y.getSeconds(),A=g!=l&&a[2]||_!=c&&a[3]||b!=u&&a[4]||C!=d&&a[5]||S!=h&&a[6]||P!=f&&a[7]||a[1];return l=g,c=_,u=b,d=C,h=S,f=P,A(y)})}}function o1(n,e){let t=If(e);return(i,s,r,o,a)=>s.map(l=>t(n(l)))}function hf(n,e,t){return new Date(n,e,t)}function P_(n,e){return e(n)}var a1="{YYYY}-{MM}-{DD} {h}:{mm}{aa}";function I_(n,e){return(t,i,s,r)=>r==null?Tf:e(n(i))}function l1(n,e){let t=n.series[e];return t.width?t.stroke(n,e):t.points.width?t.points.stroke(n,e):null}function c1(n,e){return n.series[e].fill(n,e)}var u1={show:!0,live:!0,isolate:!1,mount:RT,markers:{show:!0,width:2,stroke:l1,fill:c1,dash:"solid"},idx:null,idxs:null,values:[]};function h1(n,e){let t=n.cursor.points,i=wi(),s=t.size(n,e);$t(i,Za,s),$t(i,Ja,s);let r=s/-2;$t(i,"marginLeft",r),$t(i,"marginTop",r);let o=t.width(n,e,s);return o&&$t(i,"borderWidth",o),i}function d1(n,e){let t=n.series[e].points;return t._fill||t._stroke}function f1(n,e){let t=n.series[e].points;return t._stroke||t._fill}function p1(n,e){return n.series[e].points.size}var df=[0,0];function m1(n,e,t){return df[0]=e,df[1]=t,df}function Ru(n,e,t,i=!0){return s=>{s.button==0&&(!i||s.target==e)&&t(s)}}function ff(n,e,t,i=!0){return s=>{(!i||s.target==e)&&t(s)}}var g1={show:!0,x:!0,y:!0,lock:!1,move:m1,points:{one:!1,show:h1,size:p1,width:0,stroke:f1,fill:d1},bind:{mousedown:Ru,mouseup:Ru,click:Ru,dblclick:Ru,mousemove:ff,mouseleave:ff,mouseenter:ff},drag:{setScale:!0,x:!0,y:!1,dist:0,uni:null,click:(n,e)=>{e.stopPropagation(),e.stopImmediatePropagation()},_x:!1,_y:!1},focus:{dist:(n,e,t,i,s)=>i-s,prox:-1,bias:0},hover:{skip:[void 0],prox:null,bias:0},left:-10,top:-10,idx:null,dataIdx:null,idxs:null,event:null},h0={show:!0,stroke:"rgba(0,0,0,0.07)",width:2},Df=xn({},h0,{filter:K_}),d0=xn({},Df,{size:10}),f0=xn({},h0,{show:!1}),Nf='12px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, "Noto Sans", sans-serif, "Apple Color Emoji", "Segoe UI Emoji", "Segoe UI Symbol", "Noto Color Emoji"',p0="bold "+Nf,m0=1.5,L_={show:!0,scale:"x",stroke:wf,space:50,gap:5,alignTo:1,size:50,labelGap:0,labelSize:30,labelFont:p0,side:2,grid:Df,ticks:d0,border:f0,font:Nf,lineGap:m0,rotate:0},_1="Value",x1="Time",D_={show:!0,scale:"x",auto:!1,sorted:1,min:zt,max:-zt,idxs:[]};function v1(n,e,t,i,s){return e.map(r=>r==null?"":Rf(r))}function y1(n,e,t,i,s,r,o){let a=[],l=ir.get(s)||0;t=o?t:Vt(Ou(t,s),l);for(let c=t;c<=i;c=Vt(c+s,l))a.push(Object.is(c,-0)?0:c);return a}function vf(n,e,t,i,s,r,o){let a=[],l=n.scales[n.axes[e].scale].log,c=l==10?Rs:$_,u=xi(c(t));s=Ao(l,u),l==10&&(s=yr[Gi(s,yr)]);let d=t,h=s*l;l==10&&(h=yr[Gi(h,yr)]);do a.push(d),d=d+s,l==10&&!ir.has(d)&&(d=Vt(d,ir.get(s))),d>=h&&(s=d,h=s*l,l==10&&(h=yr[Gi(h,yr)]));while(d<=i);return a}function b1(n,e,t,i,s,r,o){let l=n.scales[n.axes[e].scale].asinh,c=i>l?vf(n,e,ii(l,t),i,s):[l],u=i>=0&&t<=0?[0]:[];return(t<-l?vf(n,e,ii(l,-i),-t,s):[l]).reverse().map(h=>-h).concat(u,c)}var g0=/./,S1=/[12357]/,M1=/[125]/,N_=/1/,yf=(n,e,t,i)=>n.map((s,r)=>e==4&&s==0||r%i==0&&t.test(s.toExponential()[s<0?1:0])?s:null);function w1(n,e,t,i,s){let r=n.axes[t],o=r.scale,a=n.scales[o],l=n.valToPos,c=r._space,u=l(10,o),d=l(9,o)-u>=c?g0:l(7,o)-u>=c?S1:l(5,o)-u>=c?M1:N_;if(d==N_){let h=An(l(1,o)-u);if(h<c)return yf(e.slice().reverse(),a.distr,d,Ti(c/h)).reverse()}return yf(e,a.distr,d,1)}function T1(n,e,t,i,s){let r=n.axes[t],o=r.scale,a=r._space,l=n.valToPos,c=An(l(1,o)-l(2,o));return c<a?yf(e.slice().reverse(),3,g0,Ti(a/c)).reverse():e}function E1(n,e,t,i){return i==null?Tf:e==null?"":Rf(e)}var U_={show:!0,scale:"y",stroke:wf,space:30,gap:5,alignTo:1,size:50,labelGap:0,labelSize:30,labelFont:p0,side:3,grid:Df,ticks:d0,border:f0,font:Nf,lineGap:m0,rotate:0};function A1(n,e){let t=3+(n||1)*2;return Vt(t*e,3)}function C1(n,e){let{scale:t,idxs:i}=n.series[0],s=n._data[0],r=n.valToPos(s[i[0]],t,!0),o=n.valToPos(s[i[1]],t,!0),a=An(o-r),l=n.series[e],c=a/(l.points.space*Ct);return i[1]-i[0]<=c}var O_={scale:null,auto:!0,sorted:0,min:zt,max:-zt},_0=(n,e,t,i,s)=>s,F_={show:!0,auto:!0,sorted:0,gaps:_0,alpha:1,facets:[xn({},O_,{scale:"x"}),xn({},O_,{scale:"y"})]},k_={scale:"y",auto:!0,sorted:0,show:!0,spanGaps:!1,gaps:_0,alpha:1,points:{show:C1,filter:null},values:null,min:zt,max:-zt,idxs:[],path:null,clip:null};function R1(n,e,t,i,s){return t/10}var x0={time:!0,auto:!0,distr:1,log:10,asinh:1,min:null,max:null,dir:1,ori:0},P1=xn({},x0,{time:!1,ori:1}),B_={};function v0(n,e){let t=B_[n];return t||(t={key:n,plots:[],sub(i){t.plots.push(i)},unsub(i){t.plots=t.plots.filter(s=>s!=i)},pub(i,s,r,o,a,l,c){for(let u=0;u<t.plots.length;u++)t.plots[u]!=s&&t.plots[u].pub(i,s,r,o,a,l,c)}},n!=null&&(B_[n]=t)),t}var Po=1,bf=2;function wr(n,e,t){let i=n.mode,s=n.series[e],r=i==2?n._data[e]:n._data,o=n.scales,a=n.bbox,l=r[0],c=i==2?r[1]:r[e],u=i==2?o[s.facets[0].scale]:o[n.series[0].scale],d=i==2?o[s.facets[1].scale]:o[s.scale],h=a.left,f=a.top,m=a.width,y=a.height,g=n.valToPosH,_=n.valToPosV;return u.ori==0?t(s,l,c,u,d,g,_,h,f,m,y,Bu,Lo,Vu,b0,M0):t(s,l,c,u,d,_,g,f,h,y,m,zu,Do,Ff,S0,w0)}function Uf(n,e){let t=0,i=0,s=Tt(n.bands,Pf);for(let r=0;r<s.length;r++){let o=s[r];o.series[0]==e?t=o.dir:o.series[1]==e&&(o.dir==1?i|=1:i|=2)}return[t,i==1?-1:i==2?1:i==3?2:0]}function I1(n,e,t,i,s){let r=n.mode,o=n.series[e],a=r==2?o.facets[1].scale:o.scale,l=n.scales[a];return s==-1?l.min:s==1?l.max:l.distr==3?l.dir==1?l.min:l.max:0}function Ps(n,e,t,i,s,r){return wr(n,e,(o,a,l,c,u,d,h,f,m,y,g)=>{let _=o.pxRound,b=c.dir*(c.ori==0?1:-1),C=c.ori==0?Lo:Do,S,P;b==1?(S=t,P=i):(S=i,P=t);let A=_(d(a[S],c,y,f)),x=_(h(l[S],u,g,m)),w=_(d(a[P],c,y,f)),F=_(h(r==1?u.max:u.min,u,g,m)),D=new Path2D(s);return C(D,w,F),C(D,A,F),C(D,A,x),D})}function ku(n,e,t,i,s,r){let o=null;if(n.length>0){o=new Path2D;let a=e==0?Vu:Ff,l=t;for(let d=0;d<n.length;d++){let h=n[d];if(h[1]>h[0]){let f=h[0]-l;f>0&&a(o,l,i,f,i+r),l=h[1]}}let c=t+s-l,u=10;c>0&&a(o,l,i-u/2,c,i+r+u)}return o}function L1(n,e,t){let i=n[n.length-1];i&&i[0]==e?i[1]=t:n.push([e,t])}function Of(n,e,t,i,s,r,o){let a=[],l=n.length;for(let c=s==1?t:i;c>=t&&c<=i;c+=s)if(e[c]===null){let d=c,h=c;if(s==1)for(;++c<=i&&e[c]===null;)h=c;else for(;--c>=t&&e[c]===null;)h=c;let f=r(n[d]),m=h==d?f:r(n[h]),y=d-s;f=o<=0&&y>=0&&y<l?r(n[y]):f;let _=h+s;m=o>=0&&_>=0&&_<l?r(n[_]):m,m>=f&&a.push([f,m])}return a}function z_(n){return n==0?J_:n==1?En:e=>vr(e,n)}function y0(n){let e=n==0?Bu:zu,t=n==0?(s,r,o,a,l,c)=>{s.arcTo(r,o,a,l,c)}:(s,r,o,a,l,c)=>{s.arcTo(o,r,l,a,c)},i=n==0?(s,r,o,a,l)=>{s.rect(r,o,a,l)}:(s,r,o,a,l)=>{s.rect(o,r,l,a)};return(s,r,o,a,l,c=0,u=0)=>{c==0&&u==0?i(s,r,o,a,l):(c=Hi(c,a/2,l/2),u=Hi(u,a/2,l/2),e(s,r+c,o),t(s,r+a,o,r+a,o+l,c),t(s,r+a,o+l,r,o+l,u),t(s,r,o+l,r,o,u),t(s,r,o,r+a,o,c),s.closePath())}}var Bu=(n,e,t)=>{n.moveTo(e,t)},zu=(n,e,t)=>{n.moveTo(t,e)},Lo=(n,e,t)=>{n.lineTo(e,t)},Do=(n,e,t)=>{n.lineTo(t,e)},Vu=y0(0),Ff=y0(1),b0=(n,e,t,i,s,r)=>{n.arc(e,t,i,s,r)},S0=(n,e,t,i,s,r)=>{n.arc(t,e,i,s,r)},M0=(n,e,t,i,s,r,o)=>{n.bezierCurveTo(e,t,i,s,r,o)},w0=(n,e,t,i,s,r,o)=>{n.bezierCurveTo(t,e,s,i,o,r)};function T0(n){return(e,t,i,s,r)=>wr(e,t,(o,a,l,c,u,d,h,f,m,y,g)=>{let{pxRound:_,points:b}=o,C,S;c.ori==0?(C=Bu,S=b0):(C=zu,S=S0);let P=Vt(b.width*Ct,3),A=(b.size-b.width)/2*Ct,x=Vt(A*2,3),w=new Path2D,F=new Path2D,{left:D,top:L,width:B,height:V}=e.bbox;Vu(F,D-x,L-x,B+x*2,V+x*2);let U=X=>{if(l[X]!=null){let $=_(d(a[X],c,y,f)),W=_(h(l[X],u,g,m));C(w,$+A,W),S(w,$,W,A,0,Pu*2)}};if(r)r.forEach(U);else for(let X=i;X<=s;X++)U(X);return{stroke:P>0?w:null,fill:w,clip:F,flags:Po|bf}})}function E0(n){return(e,t,i,s,r,o)=>{i!=s&&(r!=i&&o!=i&&n(e,t,i),r!=s&&o!=s&&n(e,t,s),n(e,t,o))}}var D1=E0(Lo),N1=E0(Do);function A0(n){let e=Tt(n?.alignGaps,0);return(t,i,s,r)=>wr(t,i,(o,a,l,c,u,d,h,f,m,y,g)=>{[s,r]=Nu(l,s,r);let _=o.pxRound,b=V=>_(d(V,c,y,f)),C=V=>_(h(V,u,g,m)),S,P;c.ori==0?(S=Lo,P=D1):(S=Do,P=N1);let A=c.dir*(c.ori==0?1:-1),x={stroke:new Path2D,fill:null,clip:null,band:null,gaps:null,flags:Po},w=x.stroke,F=!1;if(r-s>=y*4){let V=he=>t.posToVal(he,c.key,!0),U=null,X=null,$,W,ce,K=b(a[A==1?s:r]),Q=b(a[s]),se=b(a[r]),de=V(A==1?Q+1:se-1);for(let he=A==1?s:r;he>=s&&he<=r;he+=A){let ee=a[he],xe=(A==1?ee<de:ee>de)?K:b(ee),Ae=l[he];xe==K?Ae!=null?(W=Ae,U==null?(S(w,xe,C(W)),$=U=X=W):W<U?U=W:W>X&&(X=W)):Ae===null&&(F=!0):(U!=null&&P(w,K,C(U),C(X),C($),C(W)),Ae!=null?(W=Ae,S(w,xe,C(W)),U=X=$=W):(U=X=null,Ae===null&&(F=!0)),K=xe,de=V(K+A))}U!=null&&U!=X&&ce!=K&&P(w,K,C(U),C(X),C($),C(W))}else for(let V=A==1?s:r;V>=s&&V<=r;V+=A){let U=l[V];U===null?F=!0:U!=null&&S(w,b(a[V]),C(U))}let[L,B]=Uf(t,i);if(o.fill!=null||L!=0){let V=x.fill=new Path2D(w),U=o.fillTo(t,i,o.min,o.max,L),X=C(U),$=b(a[s]),W=b(a[r]);A==-1&&([W,$]=[$,W]),S(V,W,X),S(V,$,X)}if(!o.spanGaps){let V=[];F&&V.push(...Of(a,l,s,r,A,b,e)),x.gaps=V=o.gaps(t,i,s,r,V),x.clip=ku(V,c.ori,f,m,y,g)}return B!=0&&(x.band=B==2?[Ps(t,i,s,r,w,-1),Ps(t,i,s,r,w,1)]:Ps(t,i,s,r,w,B)),x})}function U1(n){let e=Tt(n.align,1),t=Tt(n.ascDesc,!1),i=Tt(n.alignGaps,0),s=Tt(n.extend,!1);return(r,o,a,l)=>wr(r,o,(c,u,d,h,f,m,y,g,_,b,C)=>{[a,l]=Nu(d,a,l);let S=c.pxRound,{left:P,width:A}=r.bbox,x=Q=>S(m(Q,h,b,g)),w=Q=>S(y(Q,f,C,_)),F=h.ori==0?Lo:Do,D={stroke:new Path2D,fill:null,clip:null,band:null,gaps:null,flags:Po},L=D.stroke,B=h.dir*(h.ori==0?1:-1),V=w(d[B==1?a:l]),U=x(u[B==1?a:l]),X=U,$=U;s&&e==-1&&($=P,F(L,$,V)),F(L,U,V);for(let Q=B==1?a:l;Q>=a&&Q<=l;Q+=B){let se=d[Q];if(se==null)continue;let de=x(u[Q]),he=w(se);e==1?F(L,de,V):F(L,X,he),F(L,de,he),V=he,X=de}let W=X;s&&e==1&&(W=P+A,F(L,W,V));let[ce,K]=Uf(r,o);if(c.fill!=null||ce!=0){let Q=D.fill=new Path2D(L),se=c.fillTo(r,o,c.min,c.max,ce),de=w(se);F(Q,W,de),F(Q,$,de)}if(!c.spanGaps){let Q=[];Q.push(...Of(u,d,a,l,B,x,i));let se=c.width*Ct/2,de=t||e==1?se:-se,he=t||e==-1?-se:se;Q.forEach(ee=>{ee[0]+=de,ee[1]+=he}),D.gaps=Q=c.gaps(r,o,a,l,Q),D.clip=ku(Q,h.ori,g,_,b,C)}return K!=0&&(D.band=K==2?[Ps(r,o,a,l,L,-1),Ps(r,o,a,l,L,1)]:Ps(r,o,a,l,L,K)),D})}function V_(n,e,t,i,s,r,o=zt){if(n.length>1){let a=null;for(let l=0,c=1/0;l<n.length;l++)if(e[l]!==void 0){if(a!=null){let u=An(n[l]-n[a]);u<c&&(c=u,o=An(t(n[l],i,s,r)-t(n[a],i,s,r)))}a=l}}return o}function O1(n){n=n||Qa;let e=Tt(n.size,[.6,zt,1]),t=n.align||0,i=n.gap||0,s=n.radius;s=s==null?[0,0]:typeof s=="number"?[s,0]:s;let r=bt(s),o=1-e[0],a=Tt(e[1],zt),l=Tt(e[2],1),c=Tt(n.disp,Qa),u=Tt(n.each,f=>{}),{fill:d,stroke:h}=c;return(f,m,y,g)=>wr(f,m,(_,b,C,S,P,A,x,w,F,D,L)=>{let B=_.pxRound,V=t,U=i*Ct,X=a*Ct,$=l*Ct,W,ce;S.ori==0?[W,ce]=r(f,m):[ce,W]=r(f,m);let K=S.dir*(S.ori==0?1:-1),Q=S.ori==0?Vu:Ff,se=S.ori==0?u:(Re,Ze,at,Me,Ft,Ve,Ye)=>{u(Re,Ze,at,Ft,Me,Ye,Ve)},de=Tt(f.bands,Pf).find(Re=>Re.series[0]==m),he=de!=null?de.dir:0,ee=_.fillTo(f,m,_.min,_.max,he),me=B(x(ee,P,L,F)),xe,Ae,Se,We=D,ot=B(_.width*Ct),Ge=!1,dt=null,ct=null,it=null,Zt=null;d!=null&&(ot==0||h!=null)&&(Ge=!0,dt=d.values(f,m,y,g),ct=new Map,new Set(dt).forEach(Re=>{Re!=null&&ct.set(Re,new Path2D)}),ot>0&&(it=h.values(f,m,y,g),Zt=new Map,new Set(it).forEach(Re=>{Re!=null&&Zt.set(Re,new Path2D)})));let{x0:Gt,size:un}=c;if(Gt!=null&&un!=null){V=1,b=Gt.values(f,m,y,g),Gt.unit==2&&(b=b.map(at=>f.posToVal(w+at*D,S.key,!0)));let Re=un.values(f,m,y,g);un.unit==2?Ae=Re[0]*D:Ae=A(Re[0],S,D,w)-A(0,S,D,w),We=V_(b,C,A,S,D,w,We),Se=We-Ae+U}else We=V_(b,C,A,S,D,w,We),Se=We*o+U,Ae=We-Se;Se<1&&(Se=0),ot>=Ae/2&&(ot=0),Se<5&&(B=J_);let Ut=Se>0,Cn=We-Se-(Ut?ot:0);Ae=B(xf(Cn,$,X)),xe=(V==0?Ae/2:V==K?0:Ae)-V*K*((V==0?U/2:0)+(Ut?ot/2:0));let St={stroke:null,fill:null,clip:null,band:null,gaps:null,flags:0},vn=Ge?null:new Path2D,tn=null;if(de!=null)tn=f.data[de.series[1]];else{let{y0:Re,y1:Ze}=c;Re!=null&&Ze!=null&&(C=Ze.values(f,m,y,g),tn=Re.values(f,m,y,g))}let hn=W*Ae,k=ce*Ae;for(let Re=K==1?y:g;Re>=y&&Re<=g;Re+=K){let Ze=C[Re];if(Ze==null)continue;if(tn!=null){let q=tn[Re]??0;if(Ze-q==0)continue;me=x(q,P,L,F)}let at=S.distr!=2||c!=null?b[Re]:Re,Me=A(at,S,D,w),Ft=x(Tt(Ze,ee),P,L,F),Ve=B(Me-xe),Ye=B(ii(Ft,me)),R=B(Hi(Ft,me)),M=Ye-R;if(Ze!=null){let q=Ze<0?k:hn,ue=Ze<0?hn:k;Ge?(ot>0&&it[Re]!=null&&Q(Zt.get(it[Re]),Ve,R+xi(ot/2),Ae,ii(0,M-ot),q,ue),dt[Re]!=null&&Q(ct.get(dt[Re]),Ve,R+xi(ot/2),Ae,ii(0,M-ot),q,ue)):Q(vn,Ve,R+xi(ot/2),Ae,ii(0,M-ot),q,ue),se(f,m,Re,Ve-ot/2,R,Ae+ot,M)}}return ot>0?St.stroke=Ge?Zt:vn:Ge||(St._fill=_.width==0?_._fill:_._stroke??_._fill,St.width=0),St.fill=Ge?ct:vn,St})}function F1(n,e){let t=Tt(e?.alignGaps,0);return(i,s,r,o)=>wr(i,s,(a,l,c,u,d,h,f,m,y,g,_)=>{[r,o]=Nu(c,r,o);let b=a.pxRound,C=W=>b(h(W,u,g,m)),S=W=>b(f(W,d,_,y)),P,A,x;u.ori==0?(P=Bu,x=Lo,A=M0):(P=zu,x=Do,A=w0);let w=u.dir*(u.ori==0?1:-1),F=C(l[w==1?r:o]),D=F,L=[],B=[];for(let W=w==1?r:o;W>=r&&W<=o;W+=w)if(c[W]!=null){let K=l[W],Q=C(K);L.push(D=Q),B.push(S(c[W]))}let V={stroke:n(L,B,P,x,A,b),fill:null,clip:null,band:null,gaps:null,flags:Po},U=V.stroke,[X,$]=Uf(i,s);if(a.fill!=null||X!=0){let W=V.fill=new Path2D(U),ce=a.fillTo(i,s,a.min,a.max,X),K=S(ce);x(W,D,K),x(W,F,K)}if(!a.spanGaps){let W=[];W.push(...Of(l,c,r,o,w,C,t)),V.gaps=W=a.gaps(i,s,r,o,W),V.clip=ku(W,u.ori,m,y,g,_)}return $!=0&&(V.band=$==2?[Ps(i,s,r,o,U,-1),Ps(i,s,r,o,U,1)]:Ps(i,s,r,o,U,$)),V})}function k1(n){return F1(B1,n)}function B1(n,e,t,i,s,r){let o=n.length;if(o<2)return null;let a=new Path2D;if(t(a,n[0],e[0]),o==2)i(a,n[1],e[1]);else{let l=Array(o),c=Array(o-1),u=Array(o-1),d=Array(o-1);for(let h=0;h<o-1;h++)u[h]=e[h+1]-e[h],d[h]=n[h+1]-n[h],c[h]=u[h]/d[h];l[0]=c[0];for(let h=1;h<o-1;h++)c[h]===0||c[h-1]===0||c[h-1]>0!=c[h]>0?l[h]=0:(l[h]=3*(d[h-1]+d[h])/((2*d[h]+d[h-1])/c[h-1]+(d[h]+2*d[h-1])/c[h]),isFinite(l[h])||(l[h]=0));l[o-1]=c[o-2];for(let h=0;h<o-1;h++)s(a,n[h]+d[h]/3,e[h]+l[h]*d[h]/3,n[h+1]-d[h]/3,e[h+1]-l[h+1]*d[h]/3,n[h+1],e[h+1])}return a}var Sf=new Set;function G_(){for(let n of Sf)n.syncRect(!0)}Io&&(Sr(vT,Eo,G_),Sr(yT,Eo,G_,!0),Sr(Iu,Eo,()=>{cn.pxRatio=Ct}));var z1=A0(),V1=T0();function H_(n,e,t,i){return(i?[n[0],n[1]].concat(n.slice(2)):[n[0]].concat(n.slice(1))).map((r,o)=>Mf(r,o,e,t))}function G1(n,e){return n.map((t,i)=>i==0?{}:xn({},e,t))}function Mf(n,e,t,i){return xn({},e==0?t:i,n)}function C0(n,e,t){return e==null?Co:[e,t]}var H1=C0;function W1(n,e,t){return e==null?Co:Lu(e,t,Cf,!0)}function R0(n,e,t,i){return e==null?Co:Uu(e,t,n.scales[i].log,!1)}var X1=R0;function P0(n,e,t,i){return e==null?Co:Af(e,t,n.scales[i].log,!1)}var q1=P0;function Y1(n,e,t,i,s){let r=ii(b_(n),b_(e)),o=e-n,a=Gi(s/i*o,t);do{let l=t[a],c=i*l/o;if(c>=s&&r+(l<5?ir.get(l):0)<=17)return[l,c]}while(++a<t.length);return[0,0]}function W_(n){let e,t;return n=n.replace(/(\d+)px/,(i,s)=>(e=En((t=+s)*Ct))+"px"),[n,e,t]}function $1(n){n.show&&[n.font,n.labelFont].forEach(e=>{let t=Vt(e[2]*Ct,1);e[0]=e[0].replace(/[0-9.]+px/,t+"px"),e[1]=t})}function cn(n,e,t){let i={mode:Tt(n.mode,1)},s=i.mode;function r(v,T,I,N){let G=T.valToPct(v);return N+I*(T.dir==-1?1-G:G)}function o(v,T,I,N){let G=T.valToPct(v);return N+I*(T.dir==-1?G:1-G)}function a(v,T,I,N){return T.ori==0?r(v,T,I,N):o(v,T,I,N)}i.valToPosH=r,i.valToPosV=o;let l=!1;i.status=0;let c=i.root=wi(tT);if(n.id!=null&&(c.id=n.id),_i(c,n.class),n.title){let v=wi(sT,c);v.textContent=n.title}let u=Vi("canvas"),d=i.ctx=u.getContext("2d"),h=wi(rT,c);Sr("click",h,v=>{v.target===m&&(Wt!=Ir||Jt!=Lr)&&On.click(i,v)},!0);let f=i.under=wi(oT,h);h.appendChild(u);let m=i.over=wi(aT,h);n=Ro(n);let y=+Tt(n.pxAlign,1),g=z_(y);(n.plugins||[]).forEach(v=>{v.opts&&(n=v.opts(i,n)||n)});let _=n.ms||.001,b=i.series=s==1?H_(n.series||[],D_,k_,!1):G1(n.series||[null],F_),C=i.axes=H_(n.axes||[],L_,U_,!0),S=i.scales={},P=i.bands=n.bands||[];P.forEach(v=>{v.fill=bt(v.fill||null),v.dir=Tt(v.dir,-1)});let A=s==2?b[1].facets[0].scale:b[0].scale,x={axes:ds,series:pt},w=(n.drawOrder||["axes","series"]).map(v=>x[v]);function F(v){let T=v.distr==3?I=>Rs(I>0?I:v.clamp(i,I,v.min,v.max,v.key)):v.distr==4?I=>uf(I,v.asinh):v.distr==100?I=>v.fwd(I):I=>I;return I=>{let N=T(I),{_min:G,_max:J}=v,ae=J-G;return(N-G)/ae}}function D(v){let T=S[v];if(T==null){let I=(n.scales||Qa)[v]||Qa;if(I.from!=null){D(I.from);let N=xn({},S[I.from],I,{key:v});N.valToPct=F(N),S[v]=N}else{T=S[v]=xn({},v==A?x0:P1,I),T.key=v;let N=T.time,G=T.range,J=nr(G);if((v!=A||s==2&&!N)&&(J&&(G[0]==null||G[1]==null)&&(G={min:G[0]==null?x_:{mode:1,hard:G[0],soft:G[0]},max:G[1]==null?x_:{mode:1,hard:G[1],soft:G[1]}},J=!1),!J&&Fu(G))){let ae=G;G=(fe,ye,De)=>ye==null?Co:Lu(ye,De,ae)}T.range=bt(G||(N?H1:v==A?T.distr==3?X1:T.distr==4?q1:C0:T.distr==3?R0:T.distr==4?P0:W1)),T.auto=bt(J?!1:T.auto),T.clamp=bt(T.clamp||R1),T._min=T._max=null,T.valToPct=F(T)}}}D("x"),D("y"),s==1&&b.forEach(v=>{D(v.scale)}),C.forEach(v=>{D(v.scale)});for(let v in n.scales)D(v);let L=S[A],B=L.distr,V,U;L.ori==0?(_i(c,nT),V=r,U=o):(_i(c,iT),V=o,U=r);let X={};for(let v in S){let T=S[v];(T.min!=null||T.max!=null)&&(X[v]={min:T.min,max:T.max},T.min=T.max=null)}let $=n.tzDate||(v=>new Date(En(v/_))),W=n.fmtDate||If,ce=_==1?n1($):r1($),K=R_($,C_(_==1?t1:s1,W)),Q=I_($,P_(a1,W)),se=[],de=i.legend=xn({},u1,n.legend),he=i.cursor=xn({},g1,{drag:{y:s==2}},n.cursor),ee=de.show,me=he.show,xe=de.markers;de.idxs=se,xe.width=bt(xe.width),xe.dash=bt(xe.dash),xe.stroke=bt(xe.stroke),xe.fill=bt(xe.fill);let Ae,Se,We,ot=[],Ge=[],dt,ct=!1,it={};if(de.live){let v=b[1]?b[1].values:null;ct=v!=null,dt=ct?v(i,1,0):{_:0};for(let T in dt)it[T]=Tf}if(ee)if(Ae=Vi("table",fT,c),We=Vi("tbody",null,Ae),de.mount(i,Ae),ct){Se=Vi("thead",null,Ae,We);let v=Vi("tr",null,Se);Vi("th",null,v);for(var Zt in dt)Vi("th",r_,v).textContent=Zt}else _i(Ae,mT),de.live&&_i(Ae,pT);let Gt={show:!0},un={show:!1};function Ut(v,T){if(T==0&&(ct||!de.live||s==2))return Co;let I=[],N=Vi("tr",gT,We,We.childNodes[T]);_i(N,v.class),v.show||_i(N,br);let G=Vi("th",null,N);if(xe.show){let fe=wi(_T,G);if(T>0){let ye=xe.width(i,T);ye&&(fe.style.border=ye+"px "+xe.dash(i,T)+" "+xe.stroke(i,T)),fe.style.background=xe.fill(i,T)}}let J=wi(r_,G);v.label instanceof HTMLElement?J.appendChild(v.label):J.textContent=v.label,T>0&&(xe.show||(J.style.color=v.width>0?xe.stroke(i,T):xe.fill(i,T)),St("click",G,fe=>{if(he._lock)return;Ke(fe);let ye=b.indexOf(v);if((fe.ctrlKey||fe.metaKey)!=de.isolate){let De=b.some((Ne,Oe)=>Oe>0&&Oe!=ye&&Ne.show);b.forEach((Ne,Oe)=>{Oe>0&&Yi(Oe,De?Oe==ye?Gt:un:Gt,!0,mn.setSeries)})}else Yi(ye,{show:!v.show},!0,mn.setSeries)},!1),je&&St(c_,G,fe=>{he._lock||(Ke(fe),Yi(b.indexOf(v),Nr,!0,mn.setSeries))},!1));for(var ae in dt){let fe=Vi("td",xT,N);fe.textContent="--",I.push(fe)}return[N,I]}let Cn=new Map;function St(v,T,I,N=!0){let G=Cn.get(T)||{},J=he.bind[v](i,T,I,N);J&&(Sr(v,T,G[v]=J),Cn.set(T,G))}function vn(v,T,I){let N=Cn.get(T)||{};for(let G in N)(v==null||G==v)&&(_f(G,T,N[G]),delete N[G]);v==null&&Cn.delete(T)}let tn=0,hn=0,k=0,Re=0,Ze=0,at=0,Me=Ze,Ft=at,Ve=k,Ye=Re,R=0,M=0,q=0,ue=0;i.bbox={};let oe=!1,_e=!1,ve=!1,te=!1,ie=!1,pe=!1;function O(v,T,I){(I||v!=i.width||T!=i.height)&&re(v,T),ut(!1),ve=!0,_e=!0,zn()}function re(v,T){i.width=tn=k=v,i.height=hn=Re=T,Ze=at=0,be(),He();let I=i.bbox;R=I.left=vr(Ze*Ct,.5),M=I.top=vr(at*Ct,.5),q=I.width=vr(k*Ct,.5),ue=I.height=vr(Re*Ct,.5)}let ne=3;function we(){let v=!1,T=0;for(;!v;){T++;let I=Cr(T),N=qi(T);v=T==ne||I&&N,v||(re(i.width,i.height),_e=!0)}}function ge({width:v,height:T}){O(v,T)}i.setSize=ge;function be(){let v=!1,T=!1,I=!1,N=!1;C.forEach((G,J)=>{if(G.show&&G._show){let{side:ae,_size:fe}=G,ye=ae%2,De=G.label!=null?G.labelSize:0,Ne=fe+De;Ne>0&&(ye?(k-=Ne,ae==3?(Ze+=Ne,N=!0):I=!0):(Re-=Ne,ae==0?(at+=Ne,v=!0):T=!0))}}),Wi[0]=v,Wi[1]=I,Wi[2]=T,Wi[3]=N,k-=Ai[1]+Ai[3],Ze+=Ai[3],Re-=Ai[2]+Ai[0],at+=Ai[0]}function He(){let v=Ze+k,T=at+Re,I=Ze,N=at;function G(J,ae){switch(J){case 1:return v+=ae,v-ae;case 2:return T+=ae,T-ae;case 3:return I-=ae,I+ae;case 0:return N-=ae,N+ae}}C.forEach((J,ae)=>{if(J.show&&J._show){let fe=J.side;J._pos=G(fe,J._size),J.label!=null&&(J._lpos=G(fe,J.labelSize))}})}if(he.dataIdx==null){let v=he.hover,T=v.skip=new Set(v.skip??[]);T.add(void 0);let I=v.prox=bt(v.prox),N=v.bias??=0;he.dataIdx=(G,J,ae,fe)=>{if(J==0)return ae;let ye=ae,De=I(G,J,ae,fe)??zt,Ne=De>=0&&De<zt,Oe=L.ori==0?k:Re,st=he.left,Et=e[0],wt=e[J];if(T.has(wt[ae])){ye=null;let gt=null,Je=null,Xe;if(N==0||N==-1)for(Xe=ae;gt==null&&Xe-- >0;)T.has(wt[Xe])||(gt=Xe);if(N==0||N==1)for(Xe=ae;Je==null&&Xe++<wt.length;)T.has(wt[Xe])||(Je=Xe);if(gt!=null||Je!=null)if(Ne){let qt=gt==null?-1/0:V(Et[gt],L,Oe,0),rn=Je==null?1/0:V(Et[Je],L,Oe,0),Ln=st-qt,Ot=rn-st;Ln<=Ot?Ln<=De&&(ye=gt):Ot<=De&&(ye=Je)}else ye=Je==null?gt:gt==null?Je:ae-gt<=Je-ae?gt:Je}else Ne&&An(st-V(Et[ae],L,Oe,0))>De&&(ye=null);return ye}}let Ke=v=>{he.event=v};he.idxs=se,he._lock=!1;let le=he.points;le.show=bt(le.show),le.size=bt(le.size),le.stroke=bt(le.stroke),le.width=bt(le.width),le.fill=bt(le.fill);let ke=i.focus=xn({},n.focus||{alpha:.3},he.focus),je=ke.prox>=0,Ce=je&&le.one,lt=[],Ht=[],Xn=[];function Oo(v,T){let I=le.show(i,T);if(I instanceof HTMLElement)return _i(I,dT),_i(I,v.class),os(I,-10,-10,k,Re),m.insertBefore(I,lt[T]),I}function Tr(v,T){if(s==1||T>0){let I=s==1&&S[v.scale].time,N=v.value;v.value=I?w_(N)?I_($,P_(N,W)):N||Q:N||E1,v.label=v.label||(I?x1:_1)}if(Ce||T>0){v.width=v.width==null?1:v.width,v.paths=v.paths||z1||PT,v.fillTo=bt(v.fillTo||I1),v.pxAlign=+Tt(v.pxAlign,y),v.pxRound=z_(v.pxAlign),v.stroke=bt(v.stroke||null),v.fill=bt(v.fill||null),v._stroke=v._fill=v._paths=v._focus=null;let I=A1(ii(1,v.width),1),N=v.points=xn({},{size:I,width:ii(1,I*.2),stroke:v.stroke,space:I*2,paths:V1,_stroke:null,_fill:null},v.points);N.show=bt(N.show),N.filter=bt(N.filter),N.fill=bt(N.fill),N.stroke=bt(N.stroke),N.paths=bt(N.paths),N.pxAlign=v.pxAlign}if(ee){let I=Ut(v,T);ot.splice(T,0,I[0]),Ge.splice(T,0,I[1]),de.values.push(null)}if(me){se.splice(T,0,null);let I=null;Ce?T==0&&(I=Oo(v,T)):T>0&&(I=Oo(v,T)),lt.splice(T,0,I),Ht.splice(T,0,0),Xn.splice(T,0,0)}In("addSeries",T)}function nh(v,T){T=T??b.length,v=s==1?Mf(v,T,D_,k_):Mf(v,T,{},F_),b.splice(T,0,v),Tr(b[T],T)}i.addSeries=nh;function nl(v){if(b.splice(v,1),ee){de.values.splice(v,1),Ge.splice(v,1);let T=ot.splice(v,1)[0];vn(null,T.firstChild),T.remove()}me&&(se.splice(v,1),lt.splice(v,1)[0].remove(),Ht.splice(v,1),Xn.splice(v,1)),In("delSeries",v)}i.delSeries=nl;let Wi=[!1,!1,!1,!1];function cs(v,T){if(v._show=v.show,v.show){let I=v.side%2,N=S[v.scale];N==null&&(v.scale=I?b[1].scale:A,N=S[v.scale]);let G=N.time;v.size=bt(v.size),v.space=bt(v.space),v.rotate=bt(v.rotate),nr(v.incrs)&&v.incrs.forEach(ae=>{!ir.has(ae)&&ir.set(ae,Q_(ae))}),v.incrs=bt(v.incrs||(N.distr==2?jT:G?_==1?e1:i1:yr)),v.splits=bt(v.splits||(G&&N.distr==1?ce:N.distr==3?vf:N.distr==4?b1:y1)),v.stroke=bt(v.stroke),v.grid.stroke=bt(v.grid.stroke),v.ticks.stroke=bt(v.ticks.stroke),v.border.stroke=bt(v.border.stroke);let J=v.values;v.values=nr(J)&&!nr(J[0])?bt(J):G?nr(J)?R_($,C_(J,W)):w_(J)?o1($,J):J||K:J||v1,v.filter=bt(v.filter||(N.distr>=3&&N.log==10?w1:N.distr==3&&N.log==2?T1:K_)),v.font=W_(v.font),v.labelFont=W_(v.labelFont),v._size=v.size(i,null,T,0),v._space=v._rotate=v._incrs=v._found=v._splits=v._values=null,v._size>0&&(Wi[T]=!0,v._el=wi(lT,h))}}function us(v,T,I,N){let[G,J,ae,fe]=I,ye=T%2,De=0;return ye==0&&(fe||J)&&(De=T==0&&!G||T==2&&!ae?En(L_.size/3):0),ye==1&&(G||ae)&&(De=T==1&&!J||T==3&&!fe?En(U_.size/2):0),De}let Fo=i.padding=(n.padding||[us,us,us,us]).map(v=>bt(Tt(v,us))),Ai=i._padding=Fo.map((v,T)=>v(i,T,Wi,0)),nn,an=null,ln=null,Xi=s==1?b[0].idxs:null,li=null,Ls=!1;function ko(v,T){if(e=v??[],i.data=i._data=e,s==2){nn=0;for(let I=1;I<b.length;I++)nn+=e[I][0].length}else{e.length==0&&(i.data=i._data=e=[[]]),li=e[0],nn=li.length;let I=e;if(B==2){I=e.slice();let N=I[0]=Array(nn);for(let G=0;G<nn;G++)N[G]=G}i._data=e=I}if(ut(!0),In("setData"),B==2&&(ve=!0),T!==!1){let I=L;I.auto(i,Ls)?Bo():Us(A,I.min,I.max),te=te||he.left>=0,pe=!0,zn()}}i.setData=ko;function Bo(){Ls=!0;let v,T;s==1&&(nn>0?(an=Xi[0]=0,ln=Xi[1]=nn-1,v=e[0][an],T=e[0][ln],B==2?(v=an,T=ln):v==T&&(B==3?[v,T]=Uu(v,v,L.log,!1):B==4?[v,T]=Af(v,v,L.log,!1):L.time?T=v+En(86400/_):[v,T]=Lu(v,T,Cf,!0))):(an=Xi[0]=v=null,ln=Xi[1]=T=null)),Us(A,v,T)}let Er,Ds,Ar,E,z,j,Y,Z,Te,Pe;function Ee(v,T,I,N,G,J){v??=a_,I??=Pf,N??="butt",G??=a_,J??="round",v!=Er&&(d.strokeStyle=Er=v),G!=Ds&&(d.fillStyle=Ds=G),T!=Ar&&(d.lineWidth=Ar=T),J!=z&&(d.lineJoin=z=J),N!=j&&(d.lineCap=j=N),I!=E&&d.setLineDash(E=I)}function Ie(v,T,I,N){T!=Ds&&(d.fillStyle=Ds=T),v!=Y&&(d.font=Y=v),I!=Z&&(d.textAlign=Z=I),N!=Te&&(d.textBaseline=Te=N)}function ze(v,T,I,N,G=0){if(N.length>0&&v.auto(i,Ls)&&(T==null||T.min==null)){let J=Tt(an,0),ae=Tt(ln,N.length-1),fe=I.min==null?wT(N,J,ae,G,v.distr==3):[I.min,I.max];v.min=Hi(v.min,I.min=fe[0]),v.max=ii(v.max,I.max=fe[1])}}let et={min:null,max:null};function ft(){for(let N in S){let G=S[N];X[N]==null&&(G.min==null||X[A]!=null&&G.auto(i,Ls))&&(X[N]=et)}for(let N in S){let G=S[N];X[N]==null&&G.from!=null&&X[G.from]!=null&&(X[N]=et)}X[A]!=null&&ut(!0);let v={};for(let N in X){let G=X[N];if(G!=null){let J=v[N]=Ro(S[N],DT);if(G.min!=null)xn(J,G);else if(N!=A||s==2)if(nn==0&&J.from==null){let ae=J.range(i,null,null,N);J.min=ae[0],J.max=ae[1]}else J.min=zt,J.max=-zt}}if(nn>0){b.forEach((N,G)=>{if(s==1){let J=N.scale,ae=X[J];if(ae==null)return;let fe=v[J];if(G==0){let ye=fe.range(i,fe.min,fe.max,J);fe.min=ye[0],fe.max=ye[1],an=Gi(fe.min,e[0]),ln=Gi(fe.max,e[0]),ln-an>1&&(e[0][an]<fe.min&&an++,e[0][ln]>fe.max&&ln--),N.min=li[an],N.max=li[ln]}else N.show&&N.auto&&ze(fe,ae,N,e[G],N.sorted);N.idxs[0]=an,N.idxs[1]=ln}else if(G>0&&N.show&&N.auto){let[J,ae]=N.facets,fe=J.scale,ye=ae.scale,[De,Ne]=e[G],Oe=v[fe],st=v[ye];Oe!=null&&ze(Oe,X[fe],J,De,J.sorted),st!=null&&ze(st,X[ye],ae,Ne,ae.sorted),N.min=ae.min,N.max=ae.max}});for(let N in v){let G=v[N],J=X[N];if(G.from==null&&(J==null||J.min==null)){let ae=G.range(i,G.min==zt?null:G.min,G.max==-zt?null:G.max,N);G.min=ae[0],G.max=ae[1]}}}for(let N in v){let G=v[N];if(G.from!=null){let J=v[G.from];if(J.min==null)G.min=G.max=null;else{let ae=G.range(i,J.min,J.max,N);G.min=ae[0],G.max=ae[1]}}}let T={},I=!1;for(let N in v){let G=v[N],J=S[N];if(J.min!=G.min||J.max!=G.max){J.min=G.min,J.max=G.max;let ae=J.distr;J._min=ae==3?Rs(J.min):ae==4?uf(J.min,J.asinh):ae==100?J.fwd(J.min):J.min,J._max=ae==3?Rs(J.max):ae==4?uf(J.max,J.asinh):ae==100?J.fwd(J.max):J.max,T[N]=I=!0}}if(I){b.forEach((N,G)=>{s==2?G>0&&T.y&&(N._paths=null):T[N.scale]&&(N._paths=null)});for(let N in T)ve=!0,In("setScale",N);me&&he.left>=0&&(te=pe=!0)}for(let N in X)X[N]=null}function Be(v){let T=xf(an-1,0,nn-1),I=xf(ln+1,0,nn-1);for(;v[T]==null&&T>0;)T--;for(;v[I]==null&&I<nn-1;)I++;return[T,I]}function pt(){if(nn>0){let v=b.some(T=>T._focus)&&Pe!=ke.alpha;v&&(d.globalAlpha=Pe=ke.alpha),b.forEach((T,I)=>{if(I>0&&T.show&&(Qt(I,!1),Qt(I,!0),T._paths==null)){let N=Pe;Pe!=T.alpha&&(d.globalAlpha=Pe=T.alpha);let G=s==2?[0,e[I][0].length-1]:Be(e[I]);T._paths=T.paths(i,I,G[0],G[1]),Pe!=N&&(d.globalAlpha=Pe=N)}}),b.forEach((T,I)=>{if(I>0&&T.show){let N=Pe;Pe!=T.alpha&&(d.globalAlpha=Pe=T.alpha),T._paths!=null&&It(I,!1);{let G=T._paths!=null?T._paths.gaps:null,J=T.points.show(i,I,an,ln,G),ae=T.points.filter(i,I,J,G);(J||ae)&&(T.points._paths=T.points.paths(i,I,an,ln,ae),It(I,!0))}Pe!=N&&(d.globalAlpha=Pe=N),In("drawSeries",I)}}),v&&(d.globalAlpha=Pe=1)}}function Qt(v,T){let I=T?b[v].points:b[v];I._stroke=I.stroke(i,v),I._fill=I.fill(i,v)}function It(v,T){let I=T?b[v].points:b[v],{stroke:N,fill:G,clip:J,flags:ae,_stroke:fe=I._stroke,_fill:ye=I._fill,_width:De=I.width}=I._paths;De=Vt(De*Ct,3);let Ne=null,Oe=De%2/2;T&&ye==null&&(ye=De>0?"#fff":fe);let st=I.pxAlign==1&&Oe>0;if(st&&d.translate(Oe,Oe),!T){let Et=R-De/2,wt=M-De/2,gt=q+De,Je=ue+De;Ne=new Path2D,Ne.rect(Et,wt,gt,Je)}T?Ue(fe,De,I.dash,I.cap,ye,N,G,ae,J):Lt(v,fe,De,I.dash,I.cap,ye,N,G,ae,Ne,J),st&&d.translate(-Oe,-Oe)}function Lt(v,T,I,N,G,J,ae,fe,ye,De,Ne){let Oe=!1;ye!=0&&P.forEach((st,Et)=>{if(st.series[0]==v){let wt=b[st.series[1]],gt=e[st.series[1]],Je=(wt._paths||Qa).band;nr(Je)&&(Je=st.dir==1?Je[0]:Je[1]);let Xe,qt=null;wt.show&&Je&&ET(gt,an,ln)?(qt=st.fill(i,Et)||J,Xe=wt._paths.clip):Je=null,Ue(T,I,N,G,qt,ae,fe,ye,De,Ne,Xe,Je),Oe=!0}}),Oe||Ue(T,I,N,G,J,ae,fe,ye,De,Ne)}let yn=Po|bf;function Ue(v,T,I,N,G,J,ae,fe,ye,De,Ne,Oe){Ee(v,T,I,N,G),(ye||De||Oe)&&(d.save(),ye&&d.clip(ye),De&&d.clip(De)),Oe?(fe&yn)==yn?(d.clip(Oe),Ne&&d.clip(Ne),xt(G,ae),dn(v,J,T)):fe&bf?(xt(G,ae),d.clip(Oe),dn(v,J,T)):fe&Po&&(d.save(),d.clip(Oe),Ne&&d.clip(Ne),xt(G,ae),d.restore(),dn(v,J,T)):(xt(G,ae),dn(v,J,T)),(ye||De||Oe)&&d.restore()}function dn(v,T,I){I>0&&(T instanceof Map?T.forEach((N,G)=>{d.strokeStyle=Er=G,d.stroke(N)}):T!=null&&v&&d.stroke(T))}function xt(v,T){T instanceof Map?T.forEach((I,N)=>{d.fillStyle=Ds=N,d.fill(I)}):T!=null&&v&&d.fill(T)}function hs(v,T,I,N){let G=C[v],J;if(N<=0)J=[0,0];else{let ae=G._space=G.space(i,v,T,I,N),fe=G._incrs=G.incrs(i,v,T,I,N,ae);J=Y1(T,I,fe,N,ae)}return G._found=J}function fn(v,T,I,N,G,J,ae,fe,ye,De){let Ne=ae%2/2;y==1&&d.translate(Ne,Ne),Ee(fe,ae,ye,De,fe),d.beginPath();let Oe,st,Et,wt,gt=G+(N==0||N==3?-J:J);I==0?(st=G,wt=gt):(Oe=G,Et=gt);for(let Je=0;Je<v.length;Je++)T[Je]!=null&&(I==0?Oe=Et=v[Je]:st=wt=v[Je],d.moveTo(Oe,st),d.lineTo(Et,wt));d.stroke(),y==1&&d.translate(-Ne,-Ne)}function Cr(v){let T=!0;return C.forEach((I,N)=>{if(!I.show)return;let G=S[I.scale];if(G.min==null){I._show&&(T=!1,I._show=!1,ut(!1));return}else I._show||(T=!1,I._show=!0,ut(!1));let J=I.side,ae=J%2,{min:fe,max:ye}=G,[De,Ne]=hs(N,fe,ye,ae==0?k:Re);if(Ne==0)return;let Oe=G.distr==2,st=I._splits=I.splits(i,N,fe,ye,De,Ne,Oe),Et=G.distr==2?st.map(Xe=>li[Xe]):st,wt=G.distr==2?li[st[1]]-li[st[0]]:De,gt=I._values=I.values(i,I.filter(i,Et,N,Ne,wt),N,Ne,wt);I._rotate=J==2?I.rotate(i,gt,N,Ne):0;let Je=I._size;I._size=Ti(I.size(i,gt,N,v)),Je!=null&&I._size!=Je&&(T=!1)}),T}function qi(v){let T=!0;return Fo.forEach((I,N)=>{let G=I(i,N,Wi,v);G!=Ai[N]&&(T=!1),Ai[N]=G}),T}function ds(){for(let v=0;v<C.length;v++){let T=C[v];if(!T.show||!T._show)continue;let I=T.side,N=I%2,G,J,ae=T.stroke(i,v),fe=I==0||I==3?-1:1,[ye,De]=T._found;if(T.label!=null){let $n=T.labelGap*fe,hi=En((T._lpos+$n)*Ct);Ie(T.labelFont[0],ae,"center",I==2?"top":o_),d.save(),N==1?(G=J=0,d.translate(hi,En(M+ue/2)),d.rotate((I==3?-Pu:Pu)/2)):(G=En(R+q/2),J=hi);let or=Z_(T.label)?T.label(i,v,ye,De):T.label;d.fillText(or,G,J),d.restore()}if(De==0)continue;let Ne=S[T.scale],Oe=N==0?q:ue,st=N==0?R:M,Et=T._splits,wt=Ne.distr==2?Et.map($n=>li[$n]):Et,gt=Ne.distr==2?li[Et[1]]-li[Et[0]]:ye,Je=T.ticks,Xe=T.border,qt=Je.show?Je.size:0,rn=En(qt*Ct),Ln=En((T.alignTo==2?T._size-qt-T.gap:T.gap)*Ct),Ot=T._rotate*-Pu/180,on=g(T._pos*Ct),ci=(rn+Ln)*fe,Yn=on+ci;J=N==0?Yn:0,G=N==1?Yn:0;let yi=T.font[0],Ci=T.align==1?wo:T.align==2?af:Ot>0?wo:Ot<0?af:N==0?"center":I==3?af:wo,Zi=Ot||N==1?"middle":I==2?"top":o_;Ie(yi,ae,Ci,Zi);let ui=T.font[1]*T.lineGap,bi=Et.map($n=>g(a($n,Ne,Oe,st))),Ri=T._values;for(let $n=0;$n<Ri.length;$n++){let hi=Ri[$n];if(hi!=null){N==0?G=bi[$n]:J=bi[$n],hi=""+hi;let or=hi.indexOf(`
`)==-1?[hi]:hi.split(/\n/gm);for(let Zn=0;Zn<or.length;Zn++){let dp=or[Zn];Ot?(d.save(),d.translate(G,J+Zn*ui),d.rotate(Ot),d.fillText(dp,0,0),d.restore()):d.fillText(dp,G,J+Zn*ui)}}}Je.show&&fn(bi,Je.filter(i,wt,v,De,gt),N,I,on,rn,Vt(Je.width*Ct,3),Je.stroke(i,v),Je.dash,Je.cap);let Ji=T.grid;Ji.show&&fn(bi,Ji.filter(i,wt,v,De,gt),N,N==0?2:1,N==0?M:R,N==0?ue:q,Vt(Ji.width*Ct,3),Ji.stroke(i,v),Ji.dash,Ji.cap),Xe.show&&fn([on],[1],N==0?1:0,N==0?1:2,N==1?M:R,N==1?ue:q,Vt(Xe.width*Ct,3),Xe.stroke(i,v),Xe.dash,Xe.cap)}In("drawAxes")}function ut(v){b.forEach((T,I)=>{I>0&&(T._paths=null,v&&(s==1?(T.min=null,T.max=null):T.facets.forEach(N=>{N.min=null,N.max=null})))})}let sn=!1,qn=!1,Dt=[];function pn(){qn=!1;for(let v=0;v<Dt.length;v++)In(...Dt[v]);Dt.length=0}function zn(){sn||(zT($f),sn=!0)}function il(v,T=!1){sn=!0,qn=T,v(i),$f(),T&&Dt.length>0&&queueMicrotask(pn)}i.batch=il;function $f(){if(oe&&(ft(),oe=!1),ve&&(we(),ve=!1),_e){if($t(f,wo,Ze),$t(f,"top",at),$t(f,Za,k),$t(f,Ja,Re),$t(m,wo,Ze),$t(m,"top",at),$t(m,Za,k),$t(m,Ja,Re),$t(h,Za,tn),$t(h,Ja,hn),u.width=En(tn*Ct),u.height=En(hn*Ct),C.forEach(({_el:v,_show:T,_size:I,_pos:N,side:G})=>{if(v!=null)if(T){let J=G===3||G===0?I:0,ae=G%2==1;$t(v,ae?"left":"top",N-J),$t(v,ae?"width":"height",I),$t(v,ae?"top":"left",ae?at:Ze),$t(v,ae?"height":"width",ae?Re:k),gf(v,br)}else _i(v,br)}),Er=Ds=Ar=z=j=Y=Z=Te=E=null,Pe=1,Go(!0),Ze!=Me||at!=Ft||k!=Ve||Re!=Ye){ut(!1);let v=k/Ve,T=Re/Ye;if(me&&!te&&he.left>=0){he.left*=v,he.top*=T,Rr&&os(Rr,En(he.left),0,k,Re),Pr&&os(Pr,0,En(he.top),k,Re);for(let I=0;I<lt.length;I++){let N=lt[I];N!=null&&(Ht[I]*=v,Xn[I]*=T,os(N,Ti(Ht[I]),Ti(Xn[I]),k,Re))}}if(Xt.show&&!ie&&Xt.left>=0&&Xt.width>0){Xt.left*=v,Xt.width*=v,Xt.top*=T,Xt.height*=T;for(let I in lh)$t(Dr,I,Xt[I])}Me=Ze,Ft=at,Ve=k,Ye=Re}In("setSize"),_e=!1}tn>0&&hn>0&&(d.clearRect(0,0,u.width,u.height),In("drawClear"),w.forEach(v=>v()),In("draw")),Xt.show&&ie&&(sl(Xt),ie=!1),me&&te&&(rr(null,!0,!1),te=!1),de.show&&de.live&&pe&&(oh(),pe=!1),l||(l=!0,i.status=1,In("ready")),Ls=!1,sn=!1}i.redraw=(v,T)=>{ve=T||!1,v!==!1?Us(A,L.min,L.max):zn()};function ih(v,T){let I=S[v];if(I.from==null){if(nn==0){let N=I.range(i,T.min,T.max,v);T.min=N[0],T.max=N[1]}if(T.min>T.max){let N=T.min;T.min=T.max,T.max=N}if(nn>1&&T.min!=null&&T.max!=null&&T.max-T.min<1e-16)return;v==A&&I.distr==2&&nn>0&&(T.min=Gi(T.min,e[0]),T.max=Gi(T.max,e[0]),T.min==T.max&&T.max++),X[v]=T,oe=!0,zn()}}i.setScale=ih;let sh,rh,Rr,Pr,Zf,Jf,Ir,Lr,Kf,jf,Wt,Jt,Ns=!1,On=he.drag,Rn=On.x,Pn=On.y;me&&(he.x&&(sh=wi(uT,m)),he.y&&(rh=wi(hT,m)),L.ori==0?(Rr=sh,Pr=rh):(Rr=rh,Pr=sh),Wt=he.left,Jt=he.top);let Xt=i.select=xn({show:!0,over:!0,left:0,width:0,top:0,height:0},n.select),Dr=Xt.show?wi(cT,Xt.over?m:f):null;function sl(v,T){if(Xt.show){for(let I in v)Xt[I]=v[I],I in lh&&$t(Dr,I,v[I]);T!==!1&&In("setSelect")}}i.setSelect=sl;function sx(v){if(b[v].show)ee&&gf(ot[v],br);else if(ee&&_i(ot[v],br),me){let I=Ce?lt[0]:lt[v];I!=null&&os(I,-10,-10,k,Re)}}function Us(v,T,I){ih(v,{min:T,max:I})}function Yi(v,T,I,N){T.focus!=null&&cx(v),T.show!=null&&b.forEach((G,J)=>{J>0&&(v==J||v==null)&&(G.show=T.show,sx(J),s==2?(Us(G.facets[0].scale,null,null),Us(G.facets[1].scale,null,null)):Us(G.scale,null,null),zn())}),I!==!1&&In("setSeries",v,T),N&&Ho("setSeries",i,v,T)}i.setSeries=Yi;function rx(v,T){xn(P[v],T)}function ox(v,T){v.fill=bt(v.fill||null),v.dir=Tt(v.dir,-1),T=T??P.length,P.splice(T,0,v)}function ax(v){v==null?P.length=0:P.splice(v,1)}i.addBand=ox,i.setBand=rx,i.delBand=ax;function lx(v,T){b[v].alpha=T,me&&lt[v]!=null&&(lt[v].style.opacity=T),ee&&ot[v]&&(ot[v].style.opacity=T)}let fs,Os,sr,Nr={focus:!0};function cx(v){if(v!=sr){let T=v==null,I=ke.alpha!=1;b.forEach((N,G)=>{if(s==1||G>0){let J=T||G==0||G==v;N._focus=T?null:J,I&&lx(G,J?1:ke.alpha)}}),sr=v,I&&zn()}}ee&&je&&St(u_,Ae,v=>{he._lock||(Ke(v),sr!=null&&Yi(null,Nr,!0,mn.setSeries))});function $i(v,T,I){let N=S[T];I&&(v=v/Ct-(N.ori==1?at:Ze));let G=k;N.ori==1&&(G=Re,v=G-v),N.dir==-1&&(v=G-v);let J=N._min,ae=N._max,fe=v/G,ye=J+(ae-J)*fe,De=N.distr;return De==3?Ao(10,ye):De==4?CT(ye,N.asinh):De==100?N.bwd(ye):ye}function ux(v,T){let I=$i(v,A,T);return Gi(I,e[0],an,ln)}i.valToIdx=v=>Gi(v,e[0]),i.posToIdx=ux,i.posToVal=$i,i.valToPos=(v,T,I)=>S[T].ori==0?r(v,S[T],I?q:k,I?R:0):o(v,S[T],I?ue:Re,I?M:0),i.setCursor=(v,T,I)=>{Wt=v.left,Jt=v.top,rr(null,T,I)};function Qf(v,T){$t(Dr,wo,Xt.left=v),$t(Dr,Za,Xt.width=T)}function ep(v,T){$t(Dr,"top",Xt.top=v),$t(Dr,Ja,Xt.height=T)}let zo=L.ori==0?Qf:ep,Vo=L.ori==1?Qf:ep;function hx(){if(ee&&de.live)for(let v=s==2?1:0;v<b.length;v++){if(v==0&&ct)continue;let T=de.values[v],I=0;for(let N in T)Ge[v][I++].firstChild.nodeValue=T[N]}}function oh(v,T){if(v!=null&&(v.idxs?v.idxs.forEach((I,N)=>{se[N]=I}):LT(v.idx)||se.fill(v.idx),de.idx=se[0]),ee&&de.live){for(let I=0;I<b.length;I++)(I>0||s==1&&!ct)&&dx(I,se[I]);hx()}pe=!1,T!==!1&&In("setLegend")}i.setLegend=oh;function dx(v,T){let I=b[v],N=v==0&&B==2?li:e[v],G;ct?G=I.values(i,v,T)??it:(G=I.value(i,T==null?null:N[T],v,T),G=G==null?it:{_:G}),de.values[v]=G}function rr(v,T,I){Kf=Wt,jf=Jt,[Wt,Jt]=he.move(i,Wt,Jt),he.left=Wt,he.top=Jt,me&&(Rr&&os(Rr,En(Wt),0,k,Re),Pr&&os(Pr,0,En(Jt),k,Re));let N,G=an>ln;fs=zt,Os=null;let J=L.ori==0?k:Re,ae=L.ori==1?k:Re;if(Wt<0||nn==0||G){N=he.idx=null;for(let fe=0;fe<b.length;fe++){let ye=lt[fe];ye!=null&&os(ye,-10,-10,k,Re)}je&&Yi(null,Nr,!0,v==null&&mn.setSeries),de.live&&(se.fill(N),pe=!0)}else{let fe,ye,De;s==1&&(fe=L.ori==0?Wt:Jt,ye=$i(fe,A),N=he.idx=Gi(ye,e[0],an,ln),De=V(e[0][N],L,J,0));let Ne=-10,Oe=-10,st=0,Et=0,wt=!0,gt="",Je="";for(let Xe=s==2?1:0;Xe<b.length;Xe++){let qt=b[Xe],rn=se[Xe],Ln=rn==null?null:s==1?e[Xe][rn]:e[Xe][1][rn],Ot=he.dataIdx(i,Xe,N,ye),on=Ot==null?null:s==1?e[Xe][Ot]:e[Xe][1][Ot];if(pe=pe||on!=Ln||Ot!=rn,se[Xe]=Ot,Xe>0&&qt.show){let ci=Ot==null?-10:Ot==N?De:V(s==1?e[0][Ot]:e[Xe][0][Ot],L,J,0),Yn=on==null?-10:U(on,s==1?S[qt.scale]:S[qt.facets[1].scale],ae,0);if(je&&on!=null){let yi=L.ori==1?Wt:Jt,Ci=An(ke.dist(i,Xe,Ot,Yn,yi));if(Ci<fs){let Zi=ke.bias;if(Zi!=0){let ui=$i(yi,qt.scale),bi=on>=0?1:-1,Ri=ui>=0?1:-1;Ri==bi&&(Ri==1?Zi==1?on>=ui:on<=ui:Zi==1?on<=ui:on>=ui)&&(fs=Ci,Os=Xe)}else fs=Ci,Os=Xe}}if(pe||Ce){let yi,Ci;L.ori==0?(yi=ci,Ci=Yn):(yi=Yn,Ci=ci);let Zi,ui,bi,Ri,Ji,$n,hi=!0,or=le.bbox;if(or!=null){hi=!1;let Zn=or(i,Xe);bi=Zn.left,Ri=Zn.top,Zi=Zn.width,ui=Zn.height}else bi=yi,Ri=Ci,Zi=ui=le.size(i,Xe);if($n=le.fill(i,Xe),Ji=le.stroke(i,Xe),Ce)Xe==Os&&fs<=ke.prox&&(Ne=bi,Oe=Ri,st=Zi,Et=ui,wt=hi,gt=$n,Je=Ji);else{let Zn=lt[Xe];Zn!=null&&(Ht[Xe]=bi,Xn[Xe]=Ri,__(Zn,Zi,ui,hi),m_(Zn,$n,Ji),os(Zn,Ti(bi),Ti(Ri),k,Re))}}}}if(Ce){let Xe=ke.prox,qt=sr==null?fs<=Xe:fs>Xe||Os!=sr;if(pe||qt){let rn=lt[0];rn!=null&&(Ht[0]=Ne,Xn[0]=Oe,__(rn,st,Et,wt),m_(rn,gt,Je),os(rn,Ti(Ne),Ti(Oe),k,Re))}}}if(Xt.show&&Ns)if(v!=null){let[fe,ye]=mn.scales,[De,Ne]=mn.match,[Oe,st]=v.cursor.sync.scales,Et=v.cursor.drag;if(Rn=Et._x,Pn=Et._y,Rn||Pn){let{left:wt,top:gt,width:Je,height:Xe}=v.select,qt=v.scales[Oe].ori,rn=v.posToVal,Ln,Ot,on,ci,Yn,yi=fe!=null&&De(fe,Oe),Ci=ye!=null&&Ne(ye,st);yi&&Rn?(qt==0?(Ln=wt,Ot=Je):(Ln=gt,Ot=Xe),on=S[fe],ci=V(rn(Ln,Oe),on,J,0),Yn=V(rn(Ln+Ot,Oe),on,J,0),zo(Hi(ci,Yn),An(Yn-ci))):zo(0,J),Ci&&Pn?(qt==1?(Ln=wt,Ot=Je):(Ln=gt,Ot=Xe),on=S[ye],ci=U(rn(Ln,st),on,ae,0),Yn=U(rn(Ln+Ot,st),on,ae,0),Vo(Hi(ci,Yn),An(Yn-ci))):Vo(0,ae)}else ch()}else{let fe=An(Kf-Zf),ye=An(jf-Jf);if(L.ori==1){let st=fe;fe=ye,ye=st}Rn=On.x&&fe>=On.dist,Pn=On.y&&ye>=On.dist;let De=On.uni;De!=null?Rn&&Pn&&(Rn=fe>=De,Pn=ye>=De,!Rn&&!Pn&&(ye>fe?Pn=!0:Rn=!0)):On.x&&On.y&&(Rn||Pn)&&(Rn=Pn=!0);let Ne,Oe;Rn&&(L.ori==0?(Ne=Ir,Oe=Wt):(Ne=Lr,Oe=Jt),zo(Hi(Ne,Oe),An(Oe-Ne)),Pn||Vo(0,ae)),Pn&&(L.ori==1?(Ne=Ir,Oe=Wt):(Ne=Lr,Oe=Jt),Vo(Hi(Ne,Oe),An(Oe-Ne)),Rn||zo(0,J)),!Rn&&!Pn&&(zo(0,0),Vo(0,0))}if(On._x=Rn,On._y=Pn,v==null){if(I){if(hp!=null){let[fe,ye]=mn.scales;mn.values[0]=fe!=null?$i(L.ori==0?Wt:Jt,fe):null,mn.values[1]=ye!=null?$i(L.ori==1?Wt:Jt,ye):null}Ho(lf,i,Wt,Jt,k,Re,N)}if(je){let fe=I&&mn.setSeries,ye=ke.prox;sr==null?fs<=ye&&Yi(Os,Nr,!0,fe):fs>ye?Yi(null,Nr,!0,fe):Os!=sr&&Yi(Os,Nr,!0,fe)}}pe&&(de.idx=N,oh()),T!==!1&&In("setCursor")}let Fs=null;Object.defineProperty(i,"rect",{get(){return Fs==null&&Go(!1),Fs}});function Go(v=!1){v?Fs=null:(Fs=m.getBoundingClientRect(),In("syncRect",Fs))}function tp(v,T,I,N,G,J,ae){he._lock||Ns&&v!=null&&v.movementX==0&&v.movementY==0||(ah(v,T,I,N,G,J,ae,!1,v!=null),v!=null?rr(null,!0,!0):rr(T,!0,!1))}function ah(v,T,I,N,G,J,ae,fe,ye){if(Fs==null&&Go(!1),Ke(v),v!=null)I=v.clientX-Fs.left,N=v.clientY-Fs.top;else{if(I<0||N<0){Wt=-10,Jt=-10;return}let[De,Ne]=mn.scales,Oe=T.cursor.sync,[st,Et]=Oe.values,[wt,gt]=Oe.scales,[Je,Xe]=mn.match,qt=T.axes[0].side%2==1,rn=L.ori==0?k:Re,Ln=L.ori==1?k:Re,Ot=qt?J:G,on=qt?G:J,ci=qt?N:I,Yn=qt?I:N;if(wt!=null?I=Je(De,wt)?a(st,S[De],rn,0):-10:I=rn*(ci/Ot),gt!=null?N=Xe(Ne,gt)?a(Et,S[Ne],Ln,0):-10:N=Ln*(Yn/on),L.ori==1){let yi=I;I=N,N=yi}}ye&&(T==null||T.cursor.event.type==lf)&&((I<=1||I>=k-1)&&(I=vr(I,k)),(N<=1||N>=Re-1)&&(N=vr(N,Re))),fe?(Zf=I,Jf=N,[Ir,Lr]=he.move(i,I,N)):(Wt=I,Jt=N)}let lh={width:0,height:0,left:0,top:0};function ch(){sl(lh,!1)}let np,ip,sp,rp;function op(v,T,I,N,G,J,ae){Ns=!0,Rn=Pn=On._x=On._y=!1,ah(v,T,I,N,G,J,ae,!0,!1),v!=null&&(St(cf,pf,ap,!1),Ho(l_,i,Ir,Lr,k,Re,null));let{left:fe,top:ye,width:De,height:Ne}=Xt;np=fe,ip=ye,sp=De,rp=Ne}function ap(v,T,I,N,G,J,ae){Ns=On._x=On._y=!1,ah(v,T,I,N,G,J,ae,!1,!0);let{left:fe,top:ye,width:De,height:Ne}=Xt,Oe=De>0||Ne>0,st=np!=fe||ip!=ye||sp!=De||rp!=Ne;if(Oe&&st&&sl(Xt),On.setScale&&Oe&&st){let Et=fe,wt=De,gt=ye,Je=Ne;if(L.ori==1&&(Et=ye,wt=Ne,gt=fe,Je=De),Rn&&Us(A,$i(Et,A),$i(Et+wt,A)),Pn)for(let Xe in S){let qt=S[Xe];Xe!=A&&qt.from==null&&qt.min!=zt&&Us(Xe,$i(gt+Je,Xe),$i(gt,Xe))}ch()}else he.lock&&(he._lock=!he._lock,rr(T,!0,v!=null));v!=null&&(vn(cf,pf),Ho(cf,i,Wt,Jt,k,Re,null))}function fx(v,T,I,N,G,J,ae){if(he._lock)return;Ke(v);let fe=Ns;if(Ns){let ye=!0,De=!0,Ne=10,Oe,st;L.ori==0?(Oe=Rn,st=Pn):(Oe=Pn,st=Rn),Oe&&st&&(ye=Wt<=Ne||Wt>=k-Ne,De=Jt<=Ne||Jt>=Re-Ne),Oe&&ye&&(Wt=Wt<Ir?0:k),st&&De&&(Jt=Jt<Lr?0:Re),rr(null,!0,!0),Ns=!1}Wt=-10,Jt=-10,se.fill(null),rr(null,!0,!0),fe&&(Ns=fe)}function lp(v,T,I,N,G,J,ae){he._lock||(Ke(v),Bo(),ch(),v!=null&&Ho(h_,i,Wt,Jt,k,Re,null))}function cp(){C.forEach($1),O(i.width,i.height,!0)}Sr(Iu,Eo,cp);let Ur={};Ur.mousedown=op,Ur.mousemove=tp,Ur.mouseup=ap,Ur.dblclick=lp,Ur.setSeries=(v,T,I,N)=>{let G=mn.match[2];I=G(i,T,I),I!=-1&&Yi(I,N,!0,!1)},me&&(St(l_,m,op),St(lf,m,tp),St(c_,m,v=>{Ke(v),Go(!1)}),St(u_,m,fx),St(h_,m,lp),Sf.add(i),i.syncRect=Go);let rl=i.hooks=n.hooks||{};function In(v,T,I){qn?Dt.push([v,T,I]):v in rl&&rl[v].forEach(N=>{N.call(null,i,T,I)})}(n.plugins||[]).forEach(v=>{for(let T in v.hooks)rl[T]=(rl[T]||[]).concat(v.hooks[T])});let up=(v,T,I)=>I,mn=xn({key:null,setSeries:!1,filters:{pub:S_,sub:S_},scales:[A,b[1]?b[1].scale:null],match:[M_,M_,up],values:[null,null]},he.sync);mn.match.length==2&&mn.match.push(up),he.sync=mn;let hp=mn.key,uh=v0(hp);function Ho(v,T,I,N,G,J,ae){mn.filters.pub(v,T,I,N,G,J,ae)&&uh.pub(v,T,I,N,G,J,ae)}uh.sub(i);function px(v,T,I,N,G,J,ae){mn.filters.sub(v,T,I,N,G,J,ae)&&Ur[v](null,T,I,N,G,J,ae)}i.pub=px;function mx(){uh.unsub(i),Sf.delete(i),Cn.clear(),_f(Iu,Eo,cp),c.remove(),Ae?.remove(),In("destroy")}i.destroy=mx;function hh(){In("init",n,e),ko(e||n.data,!1),X[A]?ih(A,X[A]):Bo(),ie=Xt.show&&(Xt.width>0||Xt.height>0),te=pe=!0,O(n.width,n.height)}return b.forEach(Tr),C.forEach(cs),t?t instanceof HTMLElement?(t.appendChild(c),hh()):t(i,hh):hh(),i}cn.assign=xn;cn.fmtNum=Rf;cn.rangeNum=Lu;cn.rangeLog=Uu;cn.rangeAsinh=Af;cn.orient=wr;cn.pxRatio=Ct;cn.join=BT;cn.fmtDate=If,cn.tzDate=JT;cn.sync=v0;{cn.addGap=L1,cn.clipGaps=ku;let n=cn.paths={points:T0};n.linear=A0,n.stepped=U1,n.bars=O1,n.spline=k1}var Wu=30,Z1=30,J1=Wu*Z1,Gu=["#2f6fb0","#d1581a","#3b8f5a","#7a3fa0","#1f8a8a","#b03a5b","#8a6d1f","#7a8797"],I0=n=>getComputedStyle(document.documentElement).getPropertyValue(n).trim(),Xu=()=>({stroke:()=>I0("--muted"),grid:{stroke:()=>I0("--line")},ticks:{show:!1},font:"11px system-ui"}),Hu=class{#e;#t;#n;constructor(e,t,i){this.#t=[[],...t.map(()=>[])];let s=Xu();this.#e=new cn({width:e.clientWidth||300,height:e.clientHeight||140,cursor:{y:!1},legend:{show:!1},scales:{x:{time:!1},y:{range:(r,o,a)=>[Math.min(o??0,0),Math.max(1.05*(a??0),i)]}},axes:[{...s,size:26,values:(r,o)=>o.map(a=>`${a} s`)},{...s,size:46}],series:[{},...t.map(({name:r},o)=>({label:r,stroke:Gu[o%Gu.length],width:1.4,spanGaps:!1}))]},this.#t,e),this.#n=new ResizeObserver(()=>{e.clientWidth&&this.#e.setSize({width:e.clientWidth,height:e.clientHeight})}),this.#n.observe(e)}add(e,t){let i=this.#t[0];i.length&&e<i[i.length-1]&&this.#t.forEach(s=>s.splice(0)),i.push(e),t.forEach((s,r)=>this.#t[r+1]?.push(s)),i.length>J1&&this.#t.forEach(s=>s.shift())}draw(){let e=this.#t[0];if(!e.length)return;let t=e[e.length-1];this.#e.setData(this.#t,!1),this.#e.setScale("x",{min:t-Wu,max:t})}close(){this.#n.disconnect(),this.#e.destroy()}},Is=n=>Gu[n%Gu.length];function qu(){let{description:n,status:e,preview:t}=_t(),i=Kt(null),s=Kt(null);vt(()=>{try{s.current=new Mo(i.current)}catch{i.current.textContent="This browser cannot draw in three dimensions (WebGL). All else works."}return()=>s.current?.close()},[]),vt(()=>{n&&s.current?.describe(n)},[n]),Zo(a=>s.current?.show(a),[]);let r=e&&cr(e),o=r?.target_m&&(r.done??1)<1;return vt(()=>{t?s.current?.aim(t.position_m,t.rotation_rad):o?s.current?.aim(r.target_m,r.target_rotation_rad??null):s.current?.aim(null,null)},[t,o,String(r?.target_m)]),p("section",{class:"card robot","aria-label":"The robot in three dimensions",children:[p("div",{class:"scene",ref:i}),p(j1,{})]})}var K1=n=>n==null?"\u2013":(1e3*n).toFixed(1);function j1(){let{description:n}=_t(),e=Kt(null),t=(n?.platform?.controlled??[]).filter(i=>i.length===1);return Zo(i=>{if(!e.current)return;let s=i.pose[0]!=null;e.current.textContent=s?t.map((r,o)=>`${r} ${K1(i.pose[o])}`).join("   ")+" mm":"position unknown until the cables are tight"},[t.join()]),n?.platform?p("output",{class:"place",ref:e}):null}function D0(){let{description:n}=_t();return n?p("section",{class:"card","aria-labelledby":"tensions",children:[p("h2",{id:"tensions",children:"Cable tensions"}),p("ul",{class:"tensions",children:n.axes.map((e,t)=>p(Q1,{number:t,name:e.name,limits:n.limits},e.name))})]}):null}function Q1({number:n,name:e,limits:t}){let i=Kt(null),s=Kt(null),r=Kt(null),o=t.tension_min_N[n]??null,a=t.tension_max_N[n]??null,l=1.15*(a??100),c=u=>({left:`${100*u/l}%`});return Zo(u=>{if(!i.current||!s.current||!r.current)return;let d=u.tension_N[n]??null,h=Math.min(Math.max(d??0,0)/l,1);i.current.style.transform=`scaleX(${h})`,i.current.style.background=`#${of(d,o,a).getHexString()}`;let f=u.tension_measured[n];s.current.textContent=d===null?"unknown":`${f?"":"~"}${d.toFixed(0)} N`,s.current.title=f?"measured by a sensor":"estimated from the motor's torque",r.current.setAttribute("aria-valuenow",(d??0).toFixed(0))},[n,l]),p("li",{children:[p("span",{class:"name",children:[p("i",{style:{background:Is(n)}}),e]}),p("div",{class:"meter",role:"meter","aria-label":`Tension of ${e} in N`,"aria-valuemin":0,"aria-valuemax":Math.round(l),"aria-valuenow":0,ref:r,children:[p("div",{class:"bar",ref:i}),o!==null&&p("i",{class:"limit",style:c(o),title:`lowest allowed: ${o} N`}),a!==null&&p("i",{class:"limit",style:c(a),title:`highest allowed: ${a} N`})]}),p("span",{class:"value",ref:s})]})}var eE=({pose:n,pose_setpoint:e})=>n[0]==null||e[0]==null?null:1e3*Math.hypot(...[0,1,2].map(t=>(n[t]??0)-(e[t]??0)));function N0(){let{description:n}=_t();return n?p("section",{class:"card trends","aria-label":`The last ${Wu} s`,children:[n.platform&&p(L0,{title:"Distance from the set-point, mm",curves:[{name:"distance",unit:"mm"}],values:e=>[eE(e)],floor:1}),p(L0,{title:"Tensions, N",curves:n.axes.map(e=>({name:e.name,unit:"N"})),values:e=>e.tension_N,floor:Math.max(...n.limits.tension_max_N.map(e=>e??10))})]}):null}function L0({title:n,curves:e,values:t,floor:i}){let s=Kt(null),r=Kt(null),o=Kt(0);return vt(()=>(r.current=new Hu(s.current,e,i),()=>r.current?.close()),[e.map(a=>a.name).join()]),Zo(a=>{r.current?.add(a.time_s,t(a)),o.current++%3===0&&r.current?.draw()},[]),p("figure",{children:[p("figcaption",{children:n}),p("div",{class:"trend",ref:s})]})}function U0(){let{events:n}=_t();return p("section",{class:"card","aria-labelledby":"events",children:[p("h2",{id:"events",children:"Events"}),n.length===0&&p("p",{class:"quiet",children:"Nothing has happened since this page was opened."}),p("ol",{class:"events",tabIndex:0,"aria-labelledby":"events",children:n.map(e=>p("li",{class:e.kind==="reason"?"reason":"",children:[p("time",{children:e.time.slice(11,19)})," ",e.text,e.times>1?` (${e.times} times)`:""]},e.number))})]})}function O0(){let{status:n}=_t();if(!n?.axes.length||!n.axes[0]?.name)return null;let e=(t,i,s=1)=>typeof t=="number"?(s*t).toFixed(i):"\u2013";return p("section",{class:"card","aria-labelledby":"drives",children:[p("h2",{id:"drives",children:"Drives"}),p("div",{class:"scroll",tabIndex:0,children:p("table",{children:[p("thead",{children:p("tr",{children:[p("th",{children:"axis"}),p("th",{children:"node"}),p("th",{children:"answers"}),p("th",{children:"angle, deg"}),p("th",{children:"torque, Nm"}),p("th",{children:"cable, m"})]})}),p("tbody",{children:n.axes.map(t=>p("tr",{children:[p("td",{children:String(t.name)}),p("td",{children:String(t.node_id)}),p("td",{children:t.alive===!1?"silent":t.valid===!1?"not valid":"yes"}),p("td",{children:e(t.position_rad,1,180/Math.PI)}),p("td",{children:e(t.torque_actual_Nm,3)}),p("td",{children:e(t.cable_length_m,4)})]},String(t.name)))})]})})]})}function F0(){let{status:n}=_t(),e=n?.parts.recording,t=e?e.recording?p(Mt,{children:[e.file?.split("/").pop(),", ",((e.bytes??0)/1e6).toFixed(1)," MB. ",p("a",{href:ps("recordings"),children:"Plot or download"})]}):p(Mt,{children:["Not recording: ",e.error||"ended"]}):p(Mt,{children:["Nothing is recorded: the daemon was started with ",p("code",{children:"--no-record"}),"."]});return p("section",{class:"card","aria-labelledby":"recording",children:[p("h2",{id:"recording",children:"Recording"}),p("p",{class:"quiet",children:rt.connected?t:"\u2013"})]})}var k0=500,Yu=null;function $u(){let{connected:n}=_t(),[e,t]=Fe(Yu),i=s=>{let r=Yu?.running&&!s.running&&s.client===Vn();t(Yu=s),r&&rt.right.release()};return vt(()=>{if(!n)return;let s=!0,r=async()=>{try{let o=await kt("GET","/procedure");s&&JSON.stringify(o)!==JSON.stringify(Yu)&&i(o)}catch{}s&&setTimeout(()=>{r()},k0)};return r(),()=>{s=!1}},[n]),{job:e,start:s=>rt.attempt(async()=>i(await rt.right.procedure(s)))}}var tE=()=>{rt.attempt(()=>kt("DELETE","/procedure"))};function Zu({job:n,curves:e=!1}){let t=n.steps.length-1;return p("section",{class:"card","aria-labelledby":"progress",children:[p("div",{class:"head",children:[p("h2",{id:"progress",children:n.running?"Running":"Last run"}),n.running&&p("button",{onClick:tE,children:n.ending?"Remove the power now":"Cancel"})]}),p("p",{class:"begun",children:[p("strong",{children:Ei(n.what)})," ",p("span",{class:"quiet",children:["by ",n.client===Vn()?"this page":n.client]})]}),n.running&&p("p",{class:"quiet",children:n.ending?`It ends: ${n.ending}.`:"Keep this page open: the procedure ends if the page is closed or falls silent."}),n.running&&!n.steps.length&&p("p",{children:Ei(n.lines.at(-1)??"starting \u2026")}),!n.running&&p(nE,{job:n}),n.steps.length>0&&p("ol",{class:"steps",children:n.steps.map(({what:i,share:s},r)=>{let o=r<t||!n.running;return p("li",{class:o?"done":"now",children:[p("span",{children:Ei(i.replace(/ \(.*% of all\)$/,""))}),!o&&s!=null?p("progress",{max:1,value:s,"aria-label":i}):p("small",{children:o?n.error&&r===t?"ended":"done":"working"})]},r)})}),e&&n.running&&p(sE,{}),n.lines.length>0&&p("details",{children:[p("summary",{children:"Messages"}),p("pre",{tabIndex:0,children:n.lines.join(`
`)})]})]})}function nE({job:n}){let e=n.reports.filter(({path:t})=>t.endsWith(".html"));return p(Mt,{children:[p("p",{class:n.error?"fault":"on",children:n.error?Ei(n.error):"It is finished."}),e.length>0&&p("p",{class:"links",children:e.map(({title:t,path:i})=>p("a",{href:i,target:"_blank",rel:"noopener",children:["Open the report: ",t]},i))})]})}var Ei=n=>{let e=n.charAt(0).toUpperCase()+n.slice(1);return/[.!?]$/.test(e)||e.length<40?e:`${e}.`},iE=[{key:"error_deg",title:"Position error, deg"},{key:"torque_Nm",title:"Torque, Nm"}];function sE(){let[n,e]=Fe(null);return vt(()=>{let t=setInterval(()=>{kt("GET","/procedure/curves").then(i=>i.time_s.length&&e(i),()=>{})},2*k0);return()=>clearInterval(t)},[]),n?.time_s.length?p("div",{class:"trends",children:iE.map(({key:t,title:i},s)=>p(rE,{title:i,time_s:n.time_s,values:n[t],colour:Is(s)},t))}):null}function rE({title:n,time_s:e,values:t,colour:i}){let s=Kt(null),r=Kt(null);return vt(()=>{let o=s.current,a=[{...Xu(),size:26,values:(c,u)=>u.map(d=>`${d} s`)},{...Xu(),size:50}];r.current=new cn({width:o.clientWidth||300,height:150,cursor:{show:!1},legend:{show:!1},scales:{x:{time:!1}},axes:a,series:[{},{stroke:i,width:1.2}]},[[],[]],o);let l=new ResizeObserver(()=>r.current?.setSize({width:o.clientWidth,height:150}));return l.observe(o),()=>{l.disconnect(),r.current?.destroy()}},[]),vt(()=>r.current?.setData([e,t]),[e]),p("figure",{children:[p("figcaption",{children:n}),p("div",{class:"trend",ref:s})]})}var kf={geometry:"Geometry",tension:"Winch tension",lens:"Camera lens"},B0={geometry:["measure","adopt","check","undo"],tension:["tension"],lens:["lens"]};function z0(){let{description:n,status:e}=_t(),{job:t,start:i}=$u(),[s,r]=Fe(null);if(!n||!e)return null;let o=Object.keys(kf).find(u=>B0[u].includes(t?.procedure??"")),a=s??o??(n.platform?"geometry":"tension"),l=t&&B0[a].includes(t.procedure)?t:null,c={geometry:aE,tension:lE,lens:cE}[a];return p(Mt,{children:[p("div",{class:"parts",role:"group","aria-label":"What to calibrate",children:Object.keys(kf).map(u=>p("button",{"aria-pressed":u===a,onClick:()=>r(u),children:kf[u]},u))}),p("div",{class:"columns",children:[p("div",{class:"column wide",children:p(c,{job:t,start:i})}),p("div",{class:"column",children:[t?.running&&!l&&p("section",{class:"card",children:p("p",{children:Ei(`${t.client} runs another procedure: ${t.what}`)})}),l&&p(Zu,{job:l}),l?.running&&l.procedure!=="undo"&&a==="geometry"&&p(qu,{}),l&&!l.running&&l.result&&p(uE,{job:l,start:i})]})]})]})}function zf({title:n,children:e}){return p("section",{class:"card","aria-label":n,children:[p("h2",{children:n}),p("ol",{class:"guide",children:e})]})}var Bf=({is:n,children:e})=>p("li",{class:n?"on":"busy",children:[n?"\u2713 ":"\u25CB ",p("span",{children:e})]}),Ju=0,oE=[Ju,20,30,50,100];function aE({job:n,start:e}){let{description:t,status:i}=_t(),[s,r]=Fe(Ju),[o,a]=Fe(!1),l=t.platform;if(!l)return p("section",{class:"card",children:p("p",{children:"This robot has no platform: there is no geometry to calibrate."})});let c=i.state==="active"&&cr(i).tight!==!1,u=i.calibration,d=t.axes.length>l.controlled.length,h=!!n?.offers.simulated_camera,f=n?.running??!1;return p(Mt,{children:p(zf,{title:"Calibrate the geometry",children:[p("li",{children:[p("h3",{children:"Before"}),p("ul",{class:"conditions",children:[p(Bf,{is:c,children:["The platform hangs at home on tight cables. ",p("em",{children:"Lower"})," and ",p("em",{children:"Tighten"})," bring it there."]}),p(Bf,{is:!u,children:["The robot runs with the geometry of its file.",u&&` Now calibration ${u.version??""} is in force: undo it, and start the robot again.`]}),!d&&p(Bf,{is:o,children:"With one cable for each direction, lengths alone show nothing. A camera or measured points are needed."})]}),u&&p("button",{disabled:f,onClick:()=>{e({procedure:"undo"})},children:"Undo the calibration in force"})]}),p("li",{children:[p("h3",{children:"Measure"}),p("p",{children:"The platform moves through poses in its box of targets. The robot reads its cables at each. Nothing is adopted yet."}),p("div",{class:"row",children:[p("label",{children:["Poses ",p("select",{value:s,onChange:m=>r(Number(m.currentTarget.value)),children:oE.map(m=>p("option",{value:m,children:m===Ju?"as many as help":m},m))})]}),h&&p("label",{class:"consent",children:[p("input",{type:"checkbox",checked:o,onChange:m=>a(m.currentTarget.checked)})," ",p("span",{children:"with the camera on the platform"})]})]}),p("div",{class:"row",children:p("button",{class:"go",disabled:!c||f||!!u,onClick:()=>{e({procedure:"measure",poses:s===Ju?null:s,camera:o})},children:"Measure"})})]}),p("li",{children:[p("h3",{children:"Judge and adopt"}),p("p",{children:"The result compares predictions with poses that were not used for the fit. Adopt it there if it is good. It takes effect at the next start."})]}),p("li",{children:[p("h3",{children:"Check later"}),p("p",{children:"Ten poses show whether a cable, a drum or an exit point has changed since."}),p("button",{disabled:!c||f,onClick:()=>{e({procedure:"check"})},children:"Check the robot"})]})]})})}function lE({job:n,start:e}){let{description:t}=_t(),i=t.axes.map(({name:d})=>d),[s,r]=Fe(i[0]??""),[o,a]=Fe("2, 5, 10"),l=o.split(",").map(Number),c=l.length>=3&&l.every(d=>d>=.05&&d<=1e3),u=`cdpr tension calibrate WINCH --masses ${l.join(",")} --bus URL`;return p(zf,{title:"Calibrate a winch by tension",children:[p("li",{children:[p("h3",{children:"Winch and masses"}),p("div",{class:"row",children:[p("label",{children:["Winch ",p("select",{value:s,onChange:d=>r(d.currentTarget.value),children:i.map(d=>p("option",{children:d},d))})]}),p("label",{children:["Masses, kg ",p("input",{value:o,size:14,"aria-invalid":!c,onInput:d=>a(d.currentTarget.value)})]})]}),!c&&p("p",{class:"fault",children:"Allowed: at least three numbers, such as 2, 5, 10."})]}),p("li",{children:[p("h3",{children:"What will happen"}),p("p",{children:"The winch raises and lowers each mass at constant speed. Torque over tension gives the gain of the winch and its friction."})]}),p("li",{children:t.simulated?p(Mt,{children:[p("p",{class:"quiet",children:"The robot is simulated: a simulated winch of its own hangs the masses itself."}),p("div",{class:"row",children:p("button",{class:"go",disabled:!c||n?.running,onClick:()=>{e({procedure:"tension",axis:s,masses_kg:l})},children:["Calibrate ",s]})})]}):p(Mt,{children:[p("p",{children:"Somebody hangs each mass and confirms it at a terminal. End the daemon first, then enter:"}),p("pre",{tabIndex:0,children:u})]})})]})}function cE({job:n,start:e}){let[t,i]=Fe(30),{description:s}=_t();return p(zf,{title:"Calibrate the camera's lens",children:[p("li",{children:[p("h3",{children:"Board"}),p("p",{children:s.simulated?"The simulated camera looks at a ChArUco board of 9 by 6 squares of 28 mm, from random places.":"Print a board with `cdpr markers board`, glue it to a flat plate, and measure a square."})]}),s.simulated?p("li",{children:[p("h3",{children:"Images"}),p("div",{class:"row",children:[p("label",{children:["Number ",p("select",{value:t,onChange:r=>i(Number(r.currentTarget.value)),children:[12,20,30,50].map(r=>p("option",{children:r},r))})]}),p("button",{class:"go",disabled:n?.running,onClick:()=>{e({procedure:"lens",images:t})},children:"Calibrate the lens"})]})]}):p("li",{children:[p("h3",{children:"Images"}),p("p",{children:"Move the board through the whole image, tilted, near and far:"}),p("pre",{tabIndex:0,children:"cdpr camera calibrate opencv:0 --out lens.toml"})]}),p("li",{children:[p("h3",{children:"What to do next"}),p("p",{children:["The result names the views that are still missing. With the lens calibrated, ",p("em",{children:"Geometry"})," can use the camera."]})]})]})}function uE({job:n,start:e}){let t=n.result;switch(n.procedure){case"measure":return p(hE,{job:n,start:e});case"adopt":return p(No,{title:"Adopted",good:!!t.in_force,text:t.in_force?"The calibration takes effect at the next start of the robot.":`Not adopted: ${String(t.not_taken_over??"")}`});case"check":return p(No,{title:"Check",good:t.ok===!0,text:t.ok?"Nothing has changed enough to matter.":"The robot has changed. The messages name the part. Calibrate it again."});case"undo":return p(No,{title:"Undone",good:!0,text:"The geometry from before applies at the next start of the robot."});case"tension":return p(dE,{job:n});case"lens":return p(fE,{job:n});default:return null}}function No({title:n,good:e,text:t,children:i}){return p("section",{class:"card","aria-label":n,children:[p("h2",{children:n}),p("p",{class:e?"on":"busy",children:p("strong",{children:Ei(t)})}),i]})}var Vf=({of:n})=>p("dl",{class:"key-figures",children:n.map(([e,t])=>p("div",{children:[p("dt",{children:e}),p("dd",{children:t})]},e))}),as=(n,e,t,i=1)=>typeof n=="number"?`${(i*n).toFixed(e)} ${t}`:"\u2013";function hE({job:n,start:e}){let t=n.result,[i,s]=Fe(!1);if(!t.verification)return null;let{verification:r,change:o}=t,a=String(n.values.measurement),l=[...new Set(t.open.map(({advice:d})=>d))],c=r.mean_position_error_before_mm,u=r.mean_position_error_mm;return p(No,{title:"Verdict",good:t.good,text:t.good?o.significant?"The calibration is good.":"The calibration is good, but changes nothing significant.":"The calibration is not good.",children:[t.objections.map(d=>p("p",{children:Ei(d)},d)),p(Vf,{of:[["Poses",String(t.poses)],["Length residual before",as(r.length_residual_before_mm,2,"mm")],["after",as(r.length_residual_mm,2,"mm")],...u!=null?[["Position error before",as(c,1,"mm")],["after",as(u,1,"mm")]]:[],["Uncertainty, 3 sigma",as(t.predicted_3_sigma_mm,1,"mm")],["Positions move by",as(o.positions_move_by_mm,1,"mm")]]}),t.faults.map(({text:d})=>p("p",{class:"fault",children:Ei(d)},d)),p(Gf,{job:n,about:"errors at the poses"}),p("details",{children:[p("summary",{children:"Whole verdict"}),p("ul",{children:t.verdict.map(d=>p("li",{children:Ei(d)},d))})]}),t.open.length>0&&p(Mt,{children:[p("h3",{class:"next-steps",children:"What to do next"}),p("ul",{children:l.map(d=>p("li",{children:[Ei(d)," ",p("small",{class:"quiet",children:["Not known without it: ",t.open.filter(h=>h.advice===d).map(({what:h})=>h).join("; "),"."]})]},d))})]}),t.good&&p(Mt,{children:[!o.significant&&p("label",{class:"consent",children:[p("input",{type:"checkbox",checked:i,onChange:d=>s(d.currentTarget.checked)})," ",p("span",{children:"Adopt it although its changes are not significant."})]}),p("div",{class:"row",children:p("button",{class:"go",disabled:!o.significant&&!i,onClick:()=>{e({procedure:"adopt",measurement:a,insignificant:i})},children:"Adopt"})})]})]})}function Gf({job:n,about:e}){return p(Mt,{children:n.reports.filter(({path:t})=>t.endsWith(".png")).map(({title:t,path:i})=>p("a",{href:i,target:"_blank",rel:"noopener",children:p("img",{class:"drawn",src:i,alt:`${t}: ${e}`})},i))})}function dE({job:n}){let e=n.result;if(!e.gain_m)return null;let t=(i,s,r)=>`${as(e[i],3,"",1e3)}\xB1 ${as(e[s],3,r,1e3)}`;return p(No,{title:"Winch",good:!0,text:"The winch is identified.",children:[p(Vf,{of:[["Gain",t("gain_m","gain_half_width_m","mNm/N")],["Friction",t("friction_Nm","friction_half_width_Nm","mNm")],["Residual, rms",as(e.residual_rms_Nm,1,"mNm",1e3)]]}),p(Gf,{job:n,about:"torque over tension, and the residuals"}),p("pre",{tabIndex:0,children:String(e.calibration??"")})]})}function fE({job:n}){let e=n.result;if(e.rms_px===void 0)return null;let t=e.missing??[];return p(No,{title:"Lens",good:t.length===0,text:t.length?"The lens is calibrated, but views are missing.":"The images are enough.",children:[p(Vf,{of:[["Corners fit to, rms",as(e.rms_px,3,"px")],["Images used",String(e.used)],["Focal lengths",(e.focal_px??[]).map(i=>i.toFixed(1)).join(", ")+" px"],["Centre",(e.centre_px??[]).map(i=>i.toFixed(1)).join(", ")+" px"]]}),t.length>0&&p(Mt,{children:[p("h3",{class:"next-steps",children:"What to do next"}),p("ul",{children:t.map(i=>p("li",{children:Ei(i)},i))})]}),(e.left_out??[]).map(i=>p("p",{class:"quiet",children:["Left out: ",i]},i)),p(Gf,{job:n,about:"detected corners over the image, their residuals, and images of the board"})]})}var pE=["unconfigured","inactive","ready"];function G0(){let{description:n,status:e,connected:t}=_t(),{job:i,start:s}=$u(),[r,o]=Fe([]),[a,l]=Fe(!0),[c,u]=Fe(!1);if(!n||!e)return null;let d=n.axes.map(({name:y})=>y).filter(y=>r.includes(y)),h=!n.simulated&&!pE.includes(e.state),f=t&&d.length>0&&c&&!h&&!i?.running,m=()=>{u(!1),s({procedure:"commission",axes:d,quick:a,detached:!0})};return p("div",{class:"columns",children:[p("div",{class:"column wide",children:p("section",{class:"card","aria-labelledby":"commission",children:[p("h2",{id:"commission",children:"Commission motors"}),p("ol",{class:"guide",children:[p("li",{children:p(mE,{description:n,axes:d,choose:o})}),p("li",{children:p("fieldset",{children:[p("legend",{children:"How thoroughly"}),p("label",{class:"consent",children:[p("input",{type:"radio",name:"plan",checked:a,onChange:()=>l(!0)})," ",p("span",{children:"Quick: a rough result after about 4 min for each motor"})]}),p("label",{class:"consent",children:[p("input",{type:"radio",name:"plan",checked:!a,onChange:()=>l(!1)})," ",p("span",{children:"Thorough: about 20 min for each motor"})]})]})}),p("li",{children:[p("h3",{children:"What will happen"}),p("p",{children:"One motor after the other finds its encoder index, turns slowly both ways, then at up to 600 deg/s, and refines the result. It then follows a ramp with and without compensation. It gets at most a quarter of its rated torque."}),p("p",{class:"quiet",children:n.simulated?"The robot is simulated: the measurement runs on simulated motors of its own, without cables.":"The control loop releases the bus for this time, and takes it again afterwards. The power is off at the end."})]}),p("li",{children:[p("h3",{children:"Detach the motors"}),p("label",{class:"consent",children:[p("input",{type:"checkbox",checked:c,disabled:!d.length,onChange:y=>u(y.currentTarget.checked)}),p("span",{children:["The cables are off the drums, the ",d.length>1?"motors turn":"motor turns"," freely, and nobody is near."]})]})]}),p("li",{children:[p("button",{class:"go",disabled:!f,onClick:m,children:["Commission",d.length?` ${d.join(", ")}`:""]}),h&&p("p",{class:"fault",children:"Switch the power off first: the motors are in use."})]})]})]})}),p("div",{class:"column",children:[i?.procedure==="commission"&&p(Zu,{job:i,curves:!0}),i?.procedure==="commission"&&!i.running&&i.result&&p(_E,{job:i}),i?.running&&i.procedure!=="commission"&&p("section",{class:"card",children:p("p",{children:[i.client," runs another procedure: ",i.what,"."]})}),i?.procedure!=="commission"&&p(gE,{})]})]})}function mE({description:n,axes:e,choose:t}){let i=n.axes.map(({name:s})=>s);return p("fieldset",{children:[p("legend",{children:"Motors"}),p("div",{class:"choice",children:n.axes.map(({name:s,motor:r})=>p("label",{class:"consent",children:[p("input",{type:"checkbox",checked:e.includes(s),onChange:o=>t(o.currentTarget.checked?[...e,s]:e.filter(a=>a!==s))}),p("span",{children:[s," ",p("small",{class:"quiet",children:r})]})]},s))}),p("button",{class:"plain",onClick:()=>t(e.length===i.length?[]:i),children:e.length===i.length?"Choose none":"Choose all"})]})}function gE(){return p("section",{class:"card","aria-labelledby":"about",children:[p("h2",{id:"about",children:"What it is for"}),p("p",{children:"Permanent magnets pull a rotor into preferred positions. This cogging and the motor's friction disturb slow motions. Commissioning measures both, so that the control can compensate them."}),p("p",{class:"quiet",children:"Nothing has been measured since the daemon was started."})]})}function _E({job:n}){let e=n.result.axes;return e?p(Mt,{children:[Object.entries(e).map(([t,i])=>p(xE,{name:t,found:i},t)),p("section",{class:"card","aria-labelledby":"use",children:[p("h2",{id:"use",children:"Use it"}),p("p",{children:"Start the robot with the measured motors:"}),p("pre",{tabIndex:0,children:["cdpr run ",String(n.values.robot)," --commissioned ",String(n.values.folder)]})]})]}):null}var V0=[["rms_position_error","Position error, rms",n=>`${n.rms_position_error_deg.toFixed(4)} deg`],["peak_pid_effort","Effort, peak",n=>`${(1e3*n.peak_pid_effort_Nm).toFixed(1)} mNm`],["peak_velocity_error","Velocity error, peak",n=>`${n.peak_velocity_error_deg_s.toFixed(2)} deg/s`]];function xE({name:n,found:e}){let{identification:t,validation:i}=e,s=i.targets.harmonic??{},r=V0.filter(([o])=>(i.harmonic.ratios[o]??1/0)<(s[o]??0));return p("section",{class:"card","aria-label":`Result of ${n}`,children:[p("h2",{children:n}),p("p",{class:r.length?"busy":"on",children:p("strong",{children:r.length?`Below its target: ${r.map(([,o])=>o.toLowerCase()).join("; ")}. The report explains why.`:"All targets are reached."})}),p("div",{class:"scroll",tabIndex:0,children:p("table",{children:[p("thead",{children:p("tr",{children:[p("th",{children:"slow ramp"}),p("th",{children:"without"}),p("th",{children:"compensated"}),p("th",{children:"smaller"})]})}),p("tbody",{children:V0.map(([o,a,l])=>p("tr",{children:[p("td",{children:a}),p("td",{children:l(i.none)}),p("td",{children:l(i.harmonic)}),p("td",{children:[i.harmonic.ratios[o]?.toFixed(1)??"\u2013"," times"]})]},o))})]})}),p("p",{class:"quiet",children:["Cogging: ",t.orders.map((o,a)=>`order ${o}, ${(1e3*t.amplitudes_Nm[a]).toFixed(1)} \xB1 ${(1e3*t.confidence_Nm[a]).toFixed(1)} mNm`).join("; ")||"none found","."," ","Friction ",(1e3*t.coulomb_forward_Nm).toFixed(0)," mNm forward, ",(1e3*t.coulomb_backward_Nm).toFixed(0)," mNm backward."]})]})}var vE=350,W0="cdpr-described",X0=[{title:"Robot",keys:/^(kind|name|frame_m|mass_kg)$/},{title:"Exit points",about:"Where the cables leave the frame. The numbers are those in the picture.",keys:/^exit_/},{title:"Anchor points",about:"Where the cables end on the platform, from its middle.",keys:/^(side_m|anchor_)/},{title:"Targets",about:"The box of targets, and where the platform stands at rest.",keys:/^(low_m|high_m|home_m|angle_deg)$/},{title:"Tensions and torques",keys:/^(torque_Nm|tension_)/},{title:"Speeds",keys:/^(speed|acceleration|angular)/},{title:"Winches and buses",keys:/./}],yE=n=>X0.findIndex(({keys:e})=>e.test(n));function bE(n,e){let t=(n.split(".").pop()??"").replace(/\[.*/,""),i=/axes\[(\d+)\]/.exec(n)?.[1],s={workspace_min_m:"low_m",workspace_max_m:"high_m",workspace_angle_rad:"angle_deg",node_id:"nodes"},r=i&&/^(exit|anchor)_point_m$/.test(t)?`${t.split("_")[0]}_${Number(i)+1}_m`:s[t]??t;return e.some(o=>o.key===r)?r:""}var SE=()=>{try{return JSON.parse(sessionStorage.getItem(W0)??"{}")}catch{return{}}};function q0(){let[n,e]=Fe(SE),[t,i]=Fe(null),[s,r]=Fe(null),[o,a]=Fe(""),l=Kt(0),c=d=>{e(d),sessionStorage.setItem(W0,JSON.stringify(d))};vt(()=>{let d=++l.current,h=setTimeout(()=>{(async()=>{try{r(null);let f=await kt("POST","/robot-file",{answers:n});if(d!==l.current)return;i(f),a("");let m=await kt("POST","/robot-file",{answers:n,diagnose:!0});d===l.current&&r(m)}catch(f){if(!(f instanceof si))throw f;d===l.current&&a(f.message)}})()},vE);return()=>clearTimeout(h)},[JSON.stringify(n)]);let u=()=>rt.attempt(async()=>{let d=await kt("POST","/robot-file",{answers:{},present:!0});c(Object.fromEntries((d.questions??[]).filter(h=>h.value!==h.default||h.key==="kind").map(h=>[h.key,h.value]))),i(d)});return p("div",{class:"columns describe",children:[p("div",{class:"column",children:[p("section",{class:"card","aria-labelledby":"describe",children:[p("h2",{id:"describe",children:"Describe a robot"}),p("p",{children:"Each field has a default that follows from the fields before it. Change what differs."}),p("div",{class:"row",children:[p("button",{onClick:()=>c({}),children:"Start anew"}),p(ME,{start:()=>{u()}})]}),(t?.notes?.length??0)>0&&p("p",{class:"busy",children:["The form leaves out of the present robot: ",t.notes.join(", "),". Add them to the file."]}),o&&p("p",{class:"fault",role:"alert",children:o}),!t&&!o&&p("p",{class:"quiet",children:"Starting the computation. This takes some seconds."})]}),t&&p(wE,{questions:t.questions??[],answers:n,answer:c})]}),p("div",{class:"column picture",children:[t&&p(AE,{platform:t.platform}),p(CE,{found:s,questions:t?.questions??[]}),t&&p(PE,{shown:t,answers:n})]})]})}function ME({start:n}){let{description:e}=_t();return e?.platform?p("button",{onClick:n,children:["Start from ",e.robot]}):null}function wE({questions:n,answers:e,answer:t}){let i=(s,r)=>{let{[s]:o,...a}=e;t(s==="kind"?r?{kind:r}:{}:r===null?a:{...a,[s]:r})};return p(Mt,{children:X0.map(({title:s,about:r},o)=>{let a=n.filter(({key:l})=>yE(l)===o);return a.length>0&&p(TE,{title:s,about:r,children:a.map(l=>p(EE,{question:l,typed:e[l.key],set:c=>i(l.key,c)},l.key))},s)})})}function TE({title:n,about:e,children:t}){return p("section",{class:"card","aria-label":n,children:[p("h2",{children:n}),e&&p("p",{class:"quiet",children:e}),p("div",{class:"fields",children:t})]})}var H0=({key:n,text:e})=>{let t=/^(?:exit|anchor)_(\d+)_m$/.exec(n);return t?`Cable ${t[1]}`:e.replace(/ \(`cdpr.*\)$/,"").replace(/^Winches:.*/,"Winches")};function EE({question:n,typed:e,set:t}){let{key:i,problem:s,choices:r,origin:o}=n,a=`hint-${i}`,l=e??n.value,c={id:`field-${i}`,value:l,"aria-describedby":a,"aria-invalid":s!==""};return p("div",{class:`field ${s?"wrong":e?"typed":"default"}`,children:[p("label",{for:`field-${i}`,children:H0(n)}),r.length>0?p("select",{...c,onChange:u=>t(u.currentTarget.value),children:r.map(u=>p("option",{children:u},u))}):p("input",{...c,autocomplete:"off",spellcheck:!1,onInput:u=>t(u.currentTarget.value)}),p("small",{id:a,children:[s||(e&&e!==n.default?"changed":o&&`default: ${o}`),e&&e!==n.default&&p(Mt,{children:[" ",p("button",{class:"plain",type:"button","aria-label":`Use the default of ${H0(n)}`,onClick:()=>t(null),children:["use ",n.default]})]})]})]})}function AE({platform:n}){let e=Kt(null),t=Kt(null);return vt(()=>{try{t.current=new Mo(e.current),t.current.numbered=!0}catch{e.current.textContent="This browser cannot draw in three dimensions (WebGL). All else works."}return()=>t.current?.close()},[]),vt(()=>{let i=n.exit_points_m.map(()=>null);t.current?.describe({platform:n,limits:{tension_min_N:i,tension_max_N:i}})},[JSON.stringify(n)]),p("section",{class:"card robot","aria-label":"The described robot in three dimensions",children:[p("div",{class:"scene",ref:e}),p("p",{class:"place",children:"at rest; the dashed box limits the targets"})]})}function CE({found:n,questions:e}){let t=n?.findings??[],i=t.filter(a=>a.impossible).length,s=n?.figures??{},r=a=>a===void 0?"\u2013":`${Math.floor(100*a)} %`,o=a=>document.getElementById(`field-${a}`)?.focus();return p("section",{class:"card","aria-labelledby":"diagnosis",children:[p("h2",{id:"diagnosis",children:"Diagnosis"}),p("p",{"aria-live":"polite",class:n?i?"fault":t.length?"busy":"on":"quiet",children:p("strong",{children:n?i?"This robot cannot work.":t.length?"It can work, with doubts.":"It can work. No problems found.":"Computing \u2026"})}),t.length>0&&p("ul",{class:"findings",children:t.map(a=>{let l=bE(a.key,e);return p("li",{class:a.impossible?"fault":"busy",children:[p("code",{children:a.key})," ",p("span",{children:a.text})," ",l&&p("button",{class:"plain",onClick:()=>o(l),children:"Go to the field"})]},a.key+a.text)})}),n&&s.held_share!==void 0&&p("dl",{class:"key-figures",children:[p("div",{children:[p("dt",{children:"Held in the box"}),p("dd",{children:r(s.held_share)})]}),p("div",{children:[p("dt",{children:"Accepted as targets"}),p("dd",{children:r(s.target_share)})]}),p("div",{children:[p("dt",{children:"Lowest resonance"}),p("dd",{children:[s.lowest_resonance_Hz?.toFixed(0)," Hz"]})]}),p("div",{children:[p("dt",{children:"Longest cable"}),p("dd",{children:[s.longest_cable_m?.toFixed(2)," m"]})]})]})]})}var RE=/^[a-z0-9][a-z0-9_-]{0,39}$/;function PE({shown:n,answers:e}){let[t,i]=Fe("my-robot"),[s,r]=Fe(""),[o,a]=Fe(""),l=n.toml??"",c=RE.test(t),u=async h=>{r(""),a("");try{let{file:f}=await kt("PUT","/robot-file",{answers:e,name:t,replace:h,client:Vn()});r(f)}catch(f){if(!(f instanceof si))throw f;f.message.includes("already exists")?a(f.message):rt.change({rejected:f.message})}},d=()=>{let h=document.createElement("a");h.href=URL.createObjectURL(new Blob([l],{type:"application/toml"})),h.download=`${t}.toml`,h.click(),setTimeout(()=>URL.revokeObjectURL(h.href),1e4)};return p("section",{class:"card","aria-labelledby":"file",children:[p("h2",{id:"file",children:"The robot's file"}),p("div",{class:"fields one",children:p("div",{class:`field ${c?"typed":"wrong"}`,children:[p("label",{for:"file-name",children:"Name of the file"}),p("input",{id:"file-name",value:t,autocomplete:"off",spellcheck:!1,"aria-invalid":!c,"aria-describedby":"file-hint",onInput:h=>{i(h.currentTarget.value),a("")}}),p("small",{id:"file-hint",children:c?`${n.folder}/${t}.toml`:"Allowed: lower-case letters, digits, - and _"})]})}),p("div",{class:"row",children:[p("button",{class:"go",disabled:!c||!n.writable,onClick:()=>{u(!1)},children:"Save"}),p("button",{disabled:!c,onClick:d,children:"Download"})]}),!n.writable&&p("p",{class:"busy",children:["The daemon cannot write into ",n.folder,". Download the file."]}),o&&p("p",{class:"busy",role:"alert",children:["A file of this name exists. ",p("button",{onClick:()=>{u(!0)},children:"Replace it"})]}),s&&p("p",{class:"on",role:"status",children:["Saved. Try it: ",p("code",{children:["cdpr run ",t," --bus simbus: --open"]})]}),p("details",{children:[p("summary",{children:"Show the file"}),p("pre",{tabIndex:0,children:l})]})]})}var IE=1e3,Ku=(n,e=2)=>typeof n=="number"?`${(1e3*n).toFixed(e)} ms`:"\u2013",Y0=(n,e)=>typeof n=="number"?n.toFixed(e):"\u2013";function Z0(){let{status:n}=_t(),[e,t]=Fe(null),[i,s]=Fe(0);vt(()=>{let o=async()=>{if(document.visibilityState==="visible")try{t(await kt("GET","/drives"))}catch{}};o();let a=setInterval(()=>{o()},IE);return()=>clearInterval(a)},[]);let r=e?.drives[i];return p("div",{class:"columns",children:[p("div",{class:"column wide",children:[p(LE,{drives:e?.drives??[],status:n,axis:i,choose:s}),r&&p(DE,{drive:r}),r&&p(UE,{axis:i,drive:r,status:n},i)]}),p("div",{class:"column",children:[p(OE,{buses:e?.buses??[],status:n}),p(FE,{status:n}),p(kE,{names:e?.drives.map(o=>o.name)??[]})]})]})}function LE({drives:n,status:e,axis:t,choose:i}){let s=e?.count?.heartbeat_age_s??[],r=e?.faults??[];return p("section",{class:"card","aria-labelledby":"drive-states",children:[p("h2",{id:"drive-states",children:"Drives"}),!n.length&&p("p",{class:"quiet",children:"No drive has answered yet."}),p("ul",{class:"drives",children:n.map((o,a)=>{let l=e?.axes[a]??{},c=r.find(d=>d.axis===a),u=l.alive===!1?"silent":l.valid===!1?"no answer in the last cycle":"answers";return p("li",{children:p("button",{class:"drive","aria-pressed":a===t,onClick:()=>i(a),children:[p("strong",{children:o.name}),p("span",{children:o.state}),c&&p("span",{class:"fault",children:c.text}),p("small",{children:["node ",o.node_id," on ",o.bus,", ",u,", heartbeat ",s[a]===void 0?"\u2013":`${(1e3*s[a]).toFixed(0)} ms ago`,", torque ",Y0(l.torque_actual_Nm,3)," Nm, tension ",Y0(l.tension_N,1)," N"]})]})},o.name)})})]})}function DE({drive:n}){return p("section",{class:"card","aria-labelledby":"bits",children:[p("h2",{id:"bits",children:["Statusword of ",n.name]}),p("p",{class:"quiet note",children:[n.drive,". Mode of operation with power: ",n.mode,"."]}),p("ul",{class:"bits",children:n.bits.map(({bit:e,name:t,on:i})=>p("li",{class:i?"set":"",children:[p("code",{children:e})," ",t,p("span",{class:"hidden",children:[": ",i?"set":"not set"]})]},e))})]})}var NE=[[24639,0],[4097,0],[24673,0],[24641,0],[24697,0],[24696,0],[24695,0],[24676,0],[4104,0],[4106,0]],$0=n=>`${n.toString(16).toUpperCase().padStart(4,"0")}h`;function UE({axis:n,drive:e,status:t}){let[i,s]=Fe([]),[r,o]=Fe("6072"),[a,l]=Fe("0"),[c,u]=Fe(""),[d,h]=Fe(""),[f,m]=Fe(!1),y=/^(0x)?[0-9a-f]{1,4}h?$/i.test(r.trim())?parseInt(r.trim().replace(/^0x/i,""),16):NaN,g=Number(a),_=Number.isFinite(y)&&/^\d{1,3}$/.test(a.trim())&&g<=255,b=/^-?(\d+|0x[0-9a-f]+)$/i.test(c.trim()),C=d.trim().toLowerCase()===r.trim().toLowerCase()&&d!=="",S=t?.state==="ready"||t?.state==="inactive",P=async x=>{m(!0);for(let[w,F]of x){let D;try{D={index:w,sub:F,why:"",answer:await kt("POST","/object",{axis:n,index:w,sub:F,client:Vn()})}}catch(L){D={index:w,sub:F,why:L.message,answer:null}}s(L=>[...L.filter(B=>B.index!==w||B.sub!==F),D])}m(!1)},A=()=>{m(!0),rt.attempt(async()=>{await rt.right.request("/object",{axis:n,index:y,sub:g,value:Number(c),client:Vn()}),h(""),await P([[y,g]])}).finally(()=>m(!1))};return p("section",{class:"card","aria-labelledby":"objects",children:[p("h2",{id:"objects",children:["Objects of ",e.name]}),p("div",{class:"row",children:[p("label",{children:["Object ",p("input",{class:"number",value:r,"aria-label":"Index of the object, hexadecimal",onInput:x=>o(x.currentTarget.value)})]}),p("label",{children:[": ",p("input",{class:"short",inputMode:"numeric",value:a,"aria-label":"Sub-index",onInput:x=>l(x.currentTarget.value)})]}),p("button",{disabled:!_||f,onClick:()=>{P([[y,g]])},children:"Read"}),p("button",{disabled:f,onClick:()=>{P(NE)},children:"Read error, mode, voltage, current"})]}),i.length>0&&p("div",{class:"scroll",tabIndex:0,role:"region","aria-label":"Values of objects",children:p("table",{children:[p("thead",{children:p("tr",{children:[p("th",{children:"object"}),p("th",{children:"name"}),p("th",{children:"value"})]})}),p("tbody",{children:i.map(({index:x,sub:w,answer:F,why:D})=>p("tr",{children:[p("td",{children:p("code",{children:[$0(x),":",w]})}),p("td",{children:F?.name||"\u2013"}),p("td",{class:F?"wrap":"wrap fault",title:F?.raw,children:F?F.text:D})]},`${x}:${w}`))})]})}),p("details",{children:[p("summary",{children:"Write an object"}),p("p",{class:"quiet note",children:"A wrong value can make a drive move or fail later. Only integers, only without power. Then all drives boot again: the boot restores the settings in the robot's file, and the platform must be tightened again."}),!S&&p("p",{class:"note",children:["Remove the power first: the robot is ",t?.state??"not connected","."]}),p("fieldset",{disabled:!S||f,children:[p("legend",{class:"hidden",children:"Write an object"}),p("div",{class:"row",children:[p("label",{children:["Value ",p("input",{class:"number",value:c,onInput:x=>u(x.currentTarget.value)})]}),p("label",{children:["Type ",r," again to agree ",p("input",{class:"number",value:d,onInput:x=>h(x.currentTarget.value)})]}),p("button",{disabled:!_||!b||!C,onClick:A,children:["Write ",_?`${$0(y)}:${g}`:""]})]})]})]})]})}function OE({buses:n,status:e}){let t=e?.buses??{};return p("section",{class:"card","aria-labelledby":"buses",children:[p("h2",{id:"buses",children:"Buses"}),n.map(({name:i,load:s,bitrate_bit_s:r})=>{let o=Object.entries(t[i]?.counts??{}).map(([a,l])=>`${l} ${a.replaceAll("_"," ")}`);return p("div",{class:"bus",children:[p("strong",{children:i})," ",p("span",{class:"quiet",children:[t[i]?.url,", ",r/1e3," kbit/s"]}),p("meter",{min:0,max:1,low:.7,high:.9,optimum:0,value:s,"aria-label":`Planned load of ${i}`}),p("small",{children:[(100*s).toFixed(0)," % of each cycle planned for frames, in the worst case. ",t[i]?.state||"No errors",o.length>0&&`: ${o.join(", ")}`]})]},i)})]})}function FE({status:n}){let e=n?.count,t=n?.cycle??{},i=[["Answers missed",String(e?.missed??"\u2013")],["Cycles that began late",`${e?.late??"\u2013"} of ${e?.cycles??"\u2013"}`],["Largest lateness",Ku(e?.worst_late_s)],["Lateness now",Ku(t.lateness_s)],["SYNC to the last answer",Ku(t.exchange_s)],["Last answer to the last command",Ku(t.compute_s)]];return p("section",{class:"card","aria-labelledby":"timing",children:[p("h2",{id:"timing",children:"Timing of the cycles"}),p("dl",{class:"figures",children:i.map(([s,r])=>p("div",{children:[p("dt",{children:s}),p("dd",{children:r})]},s))})]})}function kE({names:n}){let{events:e}=_t(),[t,i]=Fe(""),s=t?e.filter(r=>r.text.includes(t)):e;return p("section",{class:"card","aria-labelledby":"events",children:[p("h2",{id:"events",children:"Events"}),p("div",{class:"row",children:p("label",{children:["Of ",p("select",{value:t,onChange:r=>i(r.currentTarget.value),children:[p("option",{value:"",children:"everything"}),n.map(r=>p("option",{value:r,children:r},r))]})]})}),s.length===0&&p("p",{class:"quiet",children:["No event",t&&` names ${t}`,"."]}),p("ol",{class:"events",tabIndex:0,"aria-labelledby":"events",children:s.map(r=>p("li",{class:r.kind==="reason"?"reason":"",children:[p("time",{children:[r.time.slice(0,10)," ",r.time.slice(11,23)]})," ",r.text,r.times>1?` (${r.times} times)`:""]},r.number))})]})}var BE=5e3,Hf=50,zE=n=>n<1e6?`${(n/1e3).toFixed(0)} kB`:n<1e9?`${(n/1e6).toFixed(1)} MB`:`${(n/1e9).toFixed(2)} GB`;function VE(n){let e=Math.round(n),t=[Math.floor(e/3600),Math.floor(e/60)%60,e%60];return t[0]?`${t[0]} h ${t[1]} min`:t[1]?`${t[1]} min ${t[2]} s`:`${t[2]} s`}var GE=n=>new Date(n.begin).toLocaleString(void 0,{dateStyle:"medium",timeStyle:"medium"});function J0(){let{status:n}=_t(),[e,t]=Fe(null),[i,s]=Fe(Hf);vt(()=>{let o=()=>rt.attempt(async()=>t((await kt("GET","/recordings")).recordings));o();let a=setInterval(()=>document.visibilityState==="visible"&&void o(),BE);return()=>clearInterval(a)},[]);let r=n?.parts.recording;return p("section",{class:"card","aria-labelledby":"recordings",children:[p("h2",{id:"recordings",children:"Recordings"}),!r&&p("p",{class:"quiet",children:["Nothing is recorded: the daemon was started with ",p("code",{children:"--no-record"}),"."]}),r&&!r.recording&&p("p",{class:"fault",children:["Not recording: ",r.error||"ended"]}),e?.length===0&&r&&p("p",{class:"quiet",children:"There are no recordings of this robot yet."}),p("ul",{class:"recordings",children:e?.slice(0,i).map(o=>p(HE,{one:o},o.name))}),e&&e.length>i&&p("div",{class:"row",children:p("button",{onClick:()=>s(i+Hf),children:["Show ",Math.min(Hf,e.length-i)," more of ",e.length]})}),p("p",{class:"quiet note",children:["Every cycle is recorded. MCAP files open in Foxglove and in ",p("code",{children:"cdpr log"}),"; CSV is a table of all cycles, about five times as large."]})]})}function HE({one:n}){let e=`/recordings/${encodeURIComponent(n.name)}`,t=i=>()=>{rt.attempt(()=>Hp(`${e}${i}`))};return p("li",{children:[p("div",{children:[p("strong",{children:GE(n)})," ",n.live&&p("span",{class:"live",children:"being recorded"}),p("small",{children:[VE(n.duration_s),", ",zE(n.bytes),", ",p("code",{children:n.name})]})]}),p("div",{class:"row",role:"group","aria-label":n.name,children:[p("a",{class:"button",href:ps("scope",{file:n.name}),children:"Plot"}),p("button",{onClick:t(""),children:"Download MCAP"}),p("button",{onClick:t("/table.csv"),children:"Download CSV"}),p("button",{onClick:t("/picture.png"),children:"Draw picture"})]})]})}var WE=["x","y","z","qw","qx","qy","qz"],XE=3,K0=[["_rad_s","rad/s"],["_m_s","m/s"],["_rad","rad"],["_Nm","Nm"],["_N","N"],["_m","m"],["_ns","ns"],["_s","s"]],tl=n=>{let e=K0.find(([t])=>n.endsWith(t));return(e?n.slice(0,-e[0].length):n).replaceAll("_"," ")},Wf=n=>K0.find(([e])=>n.endsWith(e))?.[1]??"";function j0({name:n,per:e,labels:t},i){let s={field:n,labels:t??null},r=(a,l)=>l?`${a}, ${l}`:a;return e==="robot"?[{...s,id:n,label:r(tl(n),Wf(n)),index:null,unit:Wf(n)}]:(e==="pose"?WE:i.axes.map(a=>a.name)).map((a,l)=>{let c=e==="axis"?Wf(n):l<XE?"m":"",u=e==="axis"?`${tl(n)} of ${a}`:`${a} of the ${tl(n)}`;return{...s,id:`${n}[${a}]`,label:r(u,c),index:l,unit:c}})}function Qu({time_s:n,values:e},t,i){let s=Uo(n,t),r=Uo(n,i)+1;return{time_s:n.slice(s,r),values:e.map(o=>o.slice(s,r))}}function Uo(n,e){let t=0,i=n.length;for(;t<i;){let s=t+i>>1;n[s]<e?t=s+1:i=s}return t}var qE=45,YE=20,Xf=.2,$E=1e3,ju=class{constructor(e,t){this.curves=e;this.arrived=t;this.samples={time_s:[],values:e.map(()=>[])},this.#i()}curves;arrived;samples;triggered_s=null;#e=-1/0;#t=null;#n=null;#r=!1;close(){this.#r=!0,this.#n?.close()}async#i(){let e=[...new Set(["time_s",...this.curves.map(t=>t.field)])].join();for(;!this.#r;){try{let t=this.#n=await xl("/live",{rate_Hz:String(YE),fields:e,all_cycles:"true"});this.#r&&t.close(),await new Promise(i=>{t.onmessage=({data:s})=>this.#s(JSON.parse(s)),t.onclose=()=>i()})}catch{}await new Promise(t=>setTimeout(t,$E))}}#s(e){if(e.kind!=="cycles")return;let{time_s:t,values:i}=this.samples;for(let r of e.rows){let o=r.time_s;t.length&&o<=t[t.length-1]&&(this.samples.time_s.length=0,i.forEach(a=>a.length=0),this.rearm()),t.push(o),this.curves.forEach(({field:a,index:l},c)=>{let u=r[a],d=l===null?u:u[l];i[c].push(d==null?null:Number(d))})}let s=Uo(t,t[t.length-1]-qE);s>t.length/8&&(t.splice(0,s),i.forEach(r=>r.splice(0,s))),this.arrived()}rearm(){let{time_s:e}=this.samples;this.triggered_s=null,this.#e=e[e.length-1]??-1/0,this.#t=null}window(e,t){let{time_s:i}=this.samples,s=i[i.length-1]??0,r=i[0]??0;if(e.mode==="off")return s-r<t?[r,r+t]:[s-t,s];let o=this.triggered_s;(o===null||!e.once&&s>=o+t*(1-Xf))&&(this.triggered_s=this.#o(e)??o);let a=this.triggered_s;return a===null?null:[a-Xf*t,a+(1-Xf)*t]}#o({mode:e,curve:t,level:i,rising:s}){let{time_s:r,values:o}=this.samples,a=this.curves.findIndex(u=>u.id===t),l=o[a];if(!l)return null;let c=u=>s?u>=i:u<=i;for(let u=Uo(r,this.#e+1e-9);u<l.length;u++){let d=l[u],h=this.#t;if(this.#e=r[u],d!=null&&(this.#t=d,c(d)&&(e==="level"||h!==null&&!c(h))))return r[u]}return null}},ZE=.02,JE=.1,KE=n=>n.reduce((e,t)=>e+t,0)/n.length;function qf({time_s:n,values:e},t){let i=n.map((h,f)=>[h,e[t]?.[f]]).filter(([,h])=>h!=null);if(i.length<10)return null;let s=i[0][1],r=KE(i.slice(-Math.ceil(JE*i.length)).map(([,h])=>h)),o=r-s;if(Math.abs(o)<1e-12)return null;let a=i.map(([h,f])=>[h,(f-s)/o]),l=h=>a.find(([,f])=>f>=h)?.[0]??null,c=l(.1),u=l(.9),d=a.map(([,h])=>Math.abs(h-1)>ZE).lastIndexOf(!0);return{from:s,to:r,rise_s:c===null||u===null?null:u-c,overshoot:Math.max(0,Math.max(...a.map(([,h])=>h))-1),settling_s:d+1<a.length?a[d+1][0]-n[0]:null}}var Q0=({time_s:n,values:e},t)=>[["time_s",...t.map(i=>`"${i.id}"`)],...n.map((i,s)=>[i,...e.map(r=>r[s]??"")])].map(i=>i.join()).join(`
`)+`
`;var eh=n=>getComputedStyle(document.documentElement).getPropertyValue(n).trim(),jE=["A","B"],ex="11px system-ui",th=class{#e;#t;#n=[null,null];constructor(e,t,i){let s=[...new Set(t.map(a=>a.unit))],r={stroke:()=>eh("--muted"),ticks:{show:!1},font:ex,labelFont:ex},o=0;this.#e=new cn({width:e.clientWidth||600,height:e.clientHeight||320,legend:{show:!1},cursor:{y:!1,drag:{x:!0,y:!1,setScale:!1}},scales:{x:{time:!1},...Object.fromEntries(s.map(a=>[Yf(a),{}]))},axes:[{...r,size:34,grid:{width:1,stroke:()=>eh("--line")},values:(a,l)=>l.map(c=>`${+c.toFixed(6)} s`)},...s.map((a,l)=>({...r,scale:Yf(a),side:l%2?1:3,size:56,label:a||"\u2013",labelSize:16,grid:{width:1,show:l===0,stroke:()=>eh("--line")}}))],series:[{},...t.map(({id:a,unit:l},c)=>({label:a,scale:Yf(l),stroke:Is(c),width:1.5,points:{show:!1}}))],hooks:{setSelect:[a=>{let{left:l,width:c}=a.select;c>3&&i.zoomed(a.posToVal(l,"x"),a.posToVal(l+c,"x")),a.setSelect({left:0,top:0,width:0,height:0},!1)}],draw:[a=>this.#r(a)]}},[[],...t.map(()=>[])],e),this.#e.over.addEventListener("pointerdown",a=>o=a.clientX),this.#e.over.addEventListener("click",a=>{Math.abs(a.clientX-o)<4&&i.pressed(this.#e.posToVal(a.offsetX,"x"))}),this.#t=new ResizeObserver(()=>{e.clientWidth&&this.#e.setSize({width:e.clientWidth,height:e.clientHeight})}),this.#t.observe(e)}show(e,t,i){this.#n=i,this.#e.setData([e.time_s,...e.values],!1),this.#e.setScale("x",{min:t[0],max:t[1]})}#r({ctx:e,bbox:t,valToPos:i}){e.save(),e.textAlign="left",e.textBaseline="alphabetic",e.font=`${12*devicePixelRatio}px system-ui`,this.#n.forEach((s,r)=>{if(s===null)return;let o=i(s,"x",!0);o<t.left||o>t.left+t.width||(e.strokeStyle=e.fillStyle=eh("--text"),e.setLineDash(r?[6,4]:[]),e.beginPath(),e.moveTo(o,t.top),e.lineTo(o,t.top+t.height),e.stroke(),e.fillText(jE[r],o+4*devicePixelRatio,t.top+13*devicePixelRatio))}),e.restore()}close(){this.#t.disconnect(),this.#e.destroy()}},Yf=n=>n||"number";var QE=[1,2,5,10,20,40],eA=100,tA=6e3,nA=24,nx={time_s:[],values:[]},iA={mode:"off",curve:"",level:0,rising:!0,once:!1},tx="cdpr-scope";function ix(){let{description:n}=_t(),[e,t]=Fe([]);vt(()=>{rt.attempt(async()=>t((await kt("GET","/fields")).fields))},[]);let i=Yo(()=>n?e.flatMap(s=>j0(s,n)):[],[e,n]);return!n||!i.length?p("section",{class:"card",children:p("p",{class:"quiet",children:"Waiting for the robot's description."})}):p(rA,{known:i,quantities:e,description:n})}function sA(n,e){let t=e.platform?"tension_N":"position_rad",[i,s]=Fe(()=>{let o=JSON.parse(sessionStorage.getItem(tx)??"[]").filter(a=>n.some(l=>l.id===a));return o.length?o:n.filter(a=>a.field===t).map(a=>a.id)}),r=o=>{let a=o.slice(0,nA);sessionStorage.setItem(tx,JSON.stringify(a)),s(a)};return[Yo(()=>i.flatMap(o=>n.find(a=>a.id===o)??[]),[i,n]),r]}function rA({known:n,quantities:e,description:t}){let i=gl().args.get("file"),[s,r]=sA(n,t),o=s.map(w=>w.id).join(),[a,l]=Fe(iA),[c,u]=Fe(10),[d,h]=Fe(null),[f,m]=Fe([null,null]),y=lA(i,o,s),g=aA(i===null,o,s,a,c),{samples:_,window:b}=i===null?g:y,C=d??b;vt(()=>{h(null),m([null,null])},[i]);let S=i!==null||g.paused,P=(w,F)=>{i===null&&g.pause(),h([w,F])},A=w=>{if(!S)return;let[F,D]=f,L=F===null?0:D===null?1:Math.abs(w-F)<=Math.abs(w-D)?0:1;m(f.map((B,V)=>V===L?w:B))},x=()=>{h(null),m([null,null]),g.proceed()};return p(Mt,{children:[p("section",{class:"card scope","aria-label":"Curves",children:[p("div",{class:"row tools",children:[p("strong",{class:"source",children:i===null?"Live":i}),i===null?p(Mt,{children:[g.paused?p("button",{onClick:x,children:"Continue"}):p("button",{onClick:g.pause,children:"Pause"}),p("label",{children:["Time ",p("select",{value:c,onChange:w=>u(Number(w.currentTarget.value)),children:QE.map(w=>p("option",{value:w,children:[w," s"]},w))})]})]}):p(Mt,{children:[p("a",{class:"button",href:ps("scope"),children:"Show live values"}),d&&y.each>1&&p("button",{onClick:()=>y.read(d),children:"Read this stretch in full"})]}),d&&p("button",{onClick:()=>{h(null),i!==null&&y.read(null)},children:"Show all"}),p("button",{onClick:()=>oA(Qu(_,...C),s),disabled:!_.time_s.length,children:"Export as CSV"})]}),p(cA,{curves:s,ids:o,samples:_,window:C,cursors:f,zoomTo:P,place:A}),p("p",{class:"quiet note",role:"status",children:i===null?g.text:y.text}),p(uA,{curves:s,known:n,quantities:e,choose:r}),i===null&&p(dA,{trigger:a,change:l,curves:s,rearm:g.rearm})]}),S?p(fA,{samples:_,window:C,curves:s,cursors:f,change:m}):p("section",{class:"card",children:[p("h2",{children:"Cursors"}),p("p",{class:"quiet",children:"Pause to place cursors: they show values, differences and the figures of a step response."})]}),p(mA,{})]})}function oA(n,e){let t=URL.createObjectURL(new Blob([Q0(n,e)],{type:"text/csv"}));Eh(t,"scope.csv"),setTimeout(()=>URL.revokeObjectURL(t),1e4)}function aA(n,e,t,i,s){let[r,o]=Fe({samples:nx,window:[0,1]}),[a,l]=Fe(!1),[c,u]=Fe(""),d=Kt(null),h=Kt({trigger:i,span_s:s,paused:a});h.current={trigger:i,span_s:s,paused:a},vt(()=>{if(!n||!t.length)return;let m=0;l(!1);let y=d.current=new ju(t,()=>{let{trigger:g,span_s:_,paused:b}=h.current,C=performance.now();if(b||C-m<eA)return;m=C;let S=y.window(g,_);if(u(g.mode==="off"?"":S?`Triggered at ${y.triggered_s.toFixed(3)} s`:"Waiting for the trigger"),!S)return;o({samples:Qu(y.samples,...S),window:S});let P=y.samples.time_s[y.samples.time_s.length-1];g.mode!=="off"&&g.once&&P>=S[1]&&l(!0)});return()=>y.close()},[n,e]),vt(()=>{d.current?.rearm(),i.mode!=="off"&&l(!1)},[i]);let f=()=>{d.current?.rearm(),l(!1)};return{...r,text:a?"Paused. Drag across the curves to zoom, press on them to place a cursor.":c,paused:a,pause:()=>l(!0),proceed:f,rearm:f}}function lA(n,e,t){let[i,s]=Fe(null),[r,o]=Fe(""),a=Kt(0),l=d=>{if(n===null||!t.length)return;let h=++a.current,f=[...new Set(t.map(y=>y.field))].join(),m=d?`&from_s=${Math.max(0,d[0])}&until_s=${d[1]}`:"";o("Reading the recording. A long one takes a minute."),rt.attempt(async()=>{try{let y=await kt("GET",`/recordings/${encodeURIComponent(n)}/columns?fields=${f}&points=${tA}${m}`);if(h!==a.current)return;s(y),o(y.each>1?`${y.cycles} cycles: of each ${y.each}, the smallest and the largest value. Drag to zoom.`:`${y.cycles} cycles. Drag to zoom, press to place a cursor.`)}catch(y){throw h===a.current&&o(""),y}})};vt(()=>(s(null),l(null),()=>{a.current++}),[n,e]);let c=Yo(()=>i?{time_s:i.time_s,values:t.map(({id:d})=>i.columns[d]??[])}:nx,[i]),{time_s:u}=c;return{samples:c,window:[u[0]??0,u[u.length-1]??1],text:r,each:i?.each??1,read:l}}function cA({curves:n,ids:e,samples:t,window:i,cursors:s,zoomTo:r,place:o}){let a=Kt(null),l=Kt(null),c=Kt({zoomTo:r,place:o});return c.current={zoomTo:r,place:o},vt(()=>(l.current=new th(a.current,n,{zoomed:(u,d)=>c.current.zoomTo(u,d),pressed:u=>c.current.place(u)}),()=>l.current?.close()),[e]),vt(()=>{t.values.length===n.length&&l.current?.show(t,i,s)},[t,i[0],i[1],s,e]),p("div",{class:"plot",ref:a,role:"img","aria-label":`Curves of ${e||"nothing"}`})}function uA({curves:n,known:e,quantities:t,choose:i}){let[s,r]=Fe(t.find(h=>h.per==="axis")?.name??t[0].name),[o,a]=Fe(""),l=e.filter(h=>h.field===s),c=n.map(h=>h.id),u=l.filter(h=>!o||h.id===o).map(h=>h.id),d={axis:"Of each axis",pose:"Of the platform",robot:"Of the robot"};return p(Mt,{children:[p("ul",{class:"chips","aria-label":"Shown curves",children:n.map(({id:h,label:f},m)=>p("li",{children:[p("i",{style:{background:Is(m)}}),f,p("button",{class:"plain","aria-label":`Remove ${f}`,onClick:()=>i(c.filter(y=>y!==h)),children:"\xD7"})]},h))}),p("div",{class:"row",children:[p("label",{children:["Quantity ",p("select",{value:s,onChange:h=>{r(h.currentTarget.value),a("")},children:Object.entries(d).map(([h,f])=>p("optgroup",{label:f,children:t.filter(m=>m.per===h).map(({name:m,meaning:y})=>p("option",{value:m,title:y,children:tl(m)},m))},h))})]}),l.length>1&&p("label",{children:["Of ",p("select",{value:o,onChange:h=>a(h.currentTarget.value),children:[p("option",{value:"",children:"all"}),l.map(({id:h})=>p("option",{value:h,children:h.slice(s.length+1,-1)},h))]})]}),p("button",{onClick:()=>i([...c,...u.filter(h=>!c.includes(h))]),children:"Add"}),p("button",{onClick:()=>i(u),children:"Show only this"})]}),p("p",{class:"quiet note",children:t.find(h=>h.name===s)?.meaning})]})}var hA=[["off","none"],["edge","edge"],["level","level"]];function dA({trigger:n,change:e,curves:t,rearm:i}){let[s,r]=Fe(String(n.level)),o=t.some(l=>l.id===n.curve),a=l=>e({...n,curve:o?n.curve:t[0]?.id??"",...l});return p("fieldset",{class:"row trigger",children:[p("legend",{class:"hidden",children:"Trigger"}),p("label",{children:["Trigger ",p("select",{value:n.mode,onChange:l=>a({mode:l.currentTarget.value}),children:hA.map(([l,c])=>p("option",{value:l,children:c},l))})]}),n.mode!=="off"&&p(Mt,{children:[p("label",{children:["on ",p("select",{value:n.curve,onChange:l=>a({curve:l.currentTarget.value}),children:t.map(({id:l,label:c})=>p("option",{value:l,children:c},l))})]}),p("select",{"aria-label":"Direction",value:String(n.rising),onChange:l=>a({rising:l.currentTarget.value==="true"}),children:[p("option",{value:"true",children:n.mode==="edge"?"rising through":"at or above"}),p("option",{value:"false",children:n.mode==="edge"?"falling through":"at or below"})]}),p("input",{class:"number",inputMode:"decimal","aria-label":"Trigger level",value:s,onInput:l=>{r(l.currentTarget.value),l.currentTarget.value.trim()&&Number.isFinite(Number(l.currentTarget.value))&&a({level:Number(l.currentTarget.value)})}}),p("label",{class:"check",children:[p("input",{type:"checkbox",checked:n.once,onChange:l=>a({once:l.currentTarget.checked})})," once"]}),p("button",{onClick:i,children:"Wait again"})]})]})}var ls=n=>n==null?"\u2013":+n.toPrecision(6)+"";function fA({samples:n,window:e,curves:t,cursors:i,change:s}){let[r,o]=i,a=(d,h)=>h==null?null:n.values[d]?.[Uo(n.time_s,h)]??null,l=(d,h)=>h!==null&&d.labels?.[h]||ls(h),c=r!=null&&o!=null?[Math.min(r,o),Math.max(r,o)]:null,u=(d,h)=>p("label",{class:"slider",children:["Cursor ",d,p("input",{type:"range",min:e[0],max:e[1],step:(e[1]-e[0])/2e3,value:i[h]??e[0],onInput:f=>s(i.map((m,y)=>y===h?Number(f.currentTarget.value):m))}),p("output",{children:i[h]==null?"not placed":`${i[h].toFixed(4)} s`})]});return p("section",{class:"card","aria-labelledby":"cursors",children:[p("h2",{id:"cursors",children:"Cursors"}),u("A",0),u("B",1),r==null&&p("p",{class:"quiet note",children:"Press on the curves, or move a slider, to place a cursor."}),(r!=null||o!=null)&&p("div",{class:"scroll",tabIndex:0,role:"region","aria-label":"Values at the cursors",children:p("table",{children:[p("thead",{children:p("tr",{children:[p("th",{children:"curve"}),p("th",{class:"right",children:"A"}),p("th",{class:"right",children:"B"}),p("th",{class:"right",children:"B \u2212 A"})]})}),p("tbody",{children:[p("tr",{children:[p("td",{children:"time, s"}),p("td",{class:"right",children:ls(r)}),p("td",{class:"right",children:ls(o)}),p("td",{class:"right",children:c?ls(o-r):"\u2013"})]}),t.map((d,h)=>{let f=a(h,r),m=a(h,o);return p("tr",{children:[p("td",{children:[p("i",{class:"dot",style:{background:Is(h)}}),d.label]}),p("td",{class:"right",children:l(d,f)}),p("td",{class:"right",children:l(d,m)}),p("td",{class:"right",children:f===null||m===null?"\u2013":ls(m-f)})]},d.id)})]})]})}),c&&c[1]>c[0]&&p(pA,{samples:Qu(n,...c),curves:t})]})}function pA({samples:n,curves:e}){let[t,i]=Fe(e[0]?.id??""),s=Math.max(0,e.findIndex(u=>u.id===t)),r=e[s],o=r?e.findIndex(u=>u.id===r.id.replace(/^position_rad|^pose(?=\[)/,d=>d==="pose"?"pose_setpoint":"setpoint_rad")):-1,a=r?qf(n,s):null,l=o>=0&&o!==s?qf(n,o)?.to??n.values[o]?.at(-1):null,c=a&&r?[["Step",`${ls(a.from)} to ${ls(a.to)} ${r.unit}`],["Rise time, 10 to 90 %",a.rise_s===null?"\u2013":`${ls(a.rise_s)} s`],["Overshoot",`${(100*a.overshoot).toFixed(1)} %`],["Settling time, within 2 %",a.settling_s===null?"\u2013":`${ls(a.settling_s)} s`],["Steady error",l==null?"add the set-point's curve":`${ls(l-a.to)} ${r.unit}`]]:[];return p("div",{class:"step",children:[p("h3",{children:"Step response"}),p("div",{class:"row",children:p("label",{children:["Curve ",p("select",{value:r?.id,onChange:u=>i(u.currentTarget.value),children:e.map(({id:u,label:d})=>p("option",{value:u,children:d},u))})]})}),a?p("dl",{class:"figures",children:c.map(([u,d])=>p("div",{children:[p("dt",{children:u}),p("dd",{children:d})]},u))}):p("p",{class:"quiet note",children:"No step between the cursors. Place A where the step begins, and B where the value has settled."})]})}function mA(){let{status:n,events:e,description:t,right:i}=_t(),s=t?.own_programs,r=n?.program??"",o=s?.[r]?.arguments??(r==="path"?{feed:{low:.01,high:1,default:1}}:{}),a=Object.keys(o),[l,c]=Fe(""),[u,d]=Fe(""),h=a.includes(l)?l:a[0]??"",f=Number(u),m=o[h],y=e.filter(g=>g.kind==="set"||g.kind==="command"&&g.text.startsWith("set by"));return p("section",{class:"card","aria-labelledby":"parameters",children:[p("h2",{id:"parameters",children:"Values that may change while a program runs"}),m?p("form",{class:"row",onSubmit:g=>{g.preventDefault(),rt.attempt(()=>i.set({[h]:f}))},children:[p("label",{children:["Value of ",r," ",p("select",{value:h,onChange:g=>c(g.currentTarget.value),children:a.map(g=>p("option",{value:g,children:g},g))})]}),p("label",{children:["to ",p("input",{class:"number",inputMode:"decimal",value:u,"aria-describedby":"parameter-range",onInput:g=>d(g.currentTarget.value)})]}),p("button",{disabled:!u.trim()||!Number.isFinite(f),children:"Set"}),p("span",{id:"parameter-range",class:"quiet",children:[m.low," to ",m.high,", ",m.default," by default"]})]}):p("p",{class:"quiet note",children:[r?`The program ${r} has no such values.`:"No program runs."," A path has its feed; your own programs have their arguments."]}),y.length>0&&p("ol",{class:"events",tabIndex:0,"aria-label":"Changes",children:y.map(g=>p("li",{children:[p("time",{children:g.time.slice(11,19)})," ",g.text]},g.number))})]})}var gA=.9;function _A(){let{status:n,description:e,right:t,connected:i}=_t(),{tone:s,title:r}=Dh(),o=n?.real_time_factor,a=t.held?"You have the right to move":n?.control.held?`${n.control.client} has the right to move`:"";return p("header",{children:[p("img",{src:"page/icon.svg",alt:"",width:"28",height:"28"}),p("div",{class:"who",children:[p("strong",{children:e?.robot??n?.robot??"cdpr-rt"}),p("span",{class:"facts",children:[e&&p("span",{children:e.simulated?"simulated":"real drives"}),i&&o!=null&&o<gA&&p("span",{children:["runs at ",o.toFixed(2)," of real time"]}),a&&p("span",{children:a})]})]}),p("span",{class:`pill ${s}`,children:r.length>40?`${r.slice(0,38)}\u2026`:r}),p("div",{class:"stops",children:[p($p,{}),p(Yp,{})]})]})}function xA(){return p("div",{class:"columns",children:[p("div",{class:"column wide",children:[p(qu,{}),p(N0,{}),p(O0,{})]}),p("div",{class:"column",children:[p(jp,{}),p(D0,{}),p(U0,{}),p(F0,{}),p(Kp,{})]})]})}var vA=[{name:"robot",title:"Robot",component:xA},{name:"scope",title:"Scope",component:ix},{name:"recordings",title:"Recordings",component:J0},{name:"drives",title:"Drives and bus",component:Z0},{name:"commission",title:"Commission",component:G0},{name:"calibrate",title:"Calibrate",component:z0},{name:"describe",title:"Describe",component:q0}];function yA(){let{description:n}=_t(),{view:e}=gl(),t=vA.filter(({suits:o},a)=>a===0||ms()&&n&&(o?.(n)??!0)),{name:i,title:s,component:r}=t.find(o=>o.name===e)??t[0];return vt(()=>{document.title=`${s} \u2013 ${n?.robot??"cdpr-rt"}`,scrollTo(0,0)},[i,n?.robot]),p(Mt,{children:[p("div",{class:"top",children:[p(_A,{}),t.length>1&&p("nav",{"aria-label":"Views",children:t.map(o=>p("a",{href:ps(o.name),"aria-current":o.name===i?"page":void 0,children:o.title},o.name))}),p(Zp,{})]}),p("main",{children:[p(Jp,{}),p(r,{})]})]})}Tp(p(yA,{}),document.body);
